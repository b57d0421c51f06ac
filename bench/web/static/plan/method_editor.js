// Editor of a method: form or JSON, preview and forecast after each change, problems beside their fields, storage as a version.

import { get, post, start } from "../common/api.js";
import { withBench } from "../common/bench.js";
import { clearPlots } from "../common/axes_plot.js";
import { assess, describeNumbers } from "./forecast.js";
import { element, write } from "../common/format.js";
import { makeFirstMethod, makeMethodForm } from "./method_form.js";
import { locateProblem } from "./method_problems.js";
import { plotPreview } from "./plan_plot.js";
import { need } from "../common/rights.js";

/** Pause [ms] after a change, after which the method is checked. */
const PAUSE_MS = 700;
const DRAFT = "mrbench.method-draft.";

export class MethodEditor {
  /** Takes a function that is called after a version was stored. */
  constructor(onStored) {
    this.onStored = onStored;
    this.plots = [];
    this.checks = 0;
  }

  /** Returns the editor of a stored method; of a new one without a name. A draft of this tab is continued. */
  async open(name) {
    this.key = DRAFT + name;
    this.stored = name ? await get(`methods/${encodeURIComponent(name)}`) : makeFirstMethod();
    const draft = sessionStorage.getItem(this.key);
    ({ form: this.form, schema: this.schema } = await makeMethodForm((path) => this.change(path)));
    this.build();
    this.showForm(draft ? JSON.parse(draft) : structuredClone(this.stored));
    write(this.note, draft ? "Your unfinished draft is shown." : "");
    this.check();
    return this.place;
  }

  build() {
    this.note = element("p", { className: "note", role: "status" });
    this.problem = element("p", { className: "problem", role: "alert" });
    this.json = element("textarea", { rows: 30, spellcheck: false, className: "path", "aria-label": "Document of the method as JSON", hidden: true });
    this.json.addEventListener("input", () => this.readJson());
    this.previews = element("div", { className: "previews" });
    this.numbers = element("div");
    this.words = element("ul", { className: "words" });
    this.toggle = this.makeButton("Edit as JSON", () => this.switch());
    this.assessment = this.makeButton("Assess what the strokes identify", () => this.assess());
    const store = need("manage_methods", this.makeButton("Store as a version", () => this.store()));
    store.classList.add("primary");
    const discard = this.makeButton("Discard the draft", () => this.discard());
    this.place = element("div", { className: "editor" },
      element("p", { className: "actions" }, store, this.toggle, discard), this.note, this.problem,
      element("section", { className: "forecast", "aria-label": "Preview and forecast" }, element("h3", {}, "Preview and forecast"),
        this.previews, this.numbers, this.assessment, this.words),
      element("h3", {}, "Strokes, drives and limits"), this.form.place, this.json);
  }

  makeButton(text, act) {
    const button = element("button", { type: "button" }, text);
    button.addEventListener("click", act);
    return button;
  }

  get method() {
    return this.form.document;
  }

  showForm(method) {
    this.form.show(this.schema, method);
  }

  /** Keeps the draft, and checks it after a pause; other units follow another kind of drive. */
  change(path) {
    if (path?.join() === "drive_kind") {
      this.showForm(this.method);
      this.form.fields.get("drive_kind").field.focus();
    }
    sessionStorage.setItem(this.key, JSON.stringify(this.method));
    write(this.note, "");
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.check(), PAUSE_MS);
  }

  /** Shows the document as JSON, or the form again. */
  switch() {
    const toJson = this.json.hidden;
    if (toJson) this.json.value = JSON.stringify(this.method, null, 2);
    else if (!this.tryForm()) return;
    this.json.hidden = !toJson;
    this.form.place.hidden = toJson;
    write(this.toggle, toJson ? "Edit as a form" : "Edit as JSON");
  }

  /** Shows the JSON in the form; false if the form cannot show it. */
  tryForm() {
    try {
      this.showForm(JSON.parse(this.json.value));
      return true;
    } catch (error) {
      write(this.problem, `The form cannot show this document: ${error.message}. Correct it here first.`);
      return false;
    }
  }

  readJson() {
    try {
      this.form.document = JSON.parse(this.json.value);
    } catch (error) {
      clearTimeout(this.timer);
      this.checks += 1; // an answer on an earlier text no longer counts
      write(this.problem, `Not JSON: ${error.message}.`);
      return;
    }
    this.change();
  }

  /** Asks for a forecast of the present document; shows it, or the problem beside its field. Returns whether it is valid. */
  async check() {
    clearTimeout(this.timer);
    const number = (this.checks += 1);
    try {
      const forecast = await post("methods/dry-run", withBench({ method: this.method, identifiability: false }));
      if (number !== this.checks || this.isClosed) return false; // it was changed or left meanwhile
      this.showProblem("");
      this.showForecast(forecast);
      return true;
    } catch (problem) {
      if (number === this.checks) this.showProblem(problem.message);
      return false;
    }
  }

  showForecast(forecast) {
    const { preview } = forecast;
    clearPlots(this.plots);
    this.previews.replaceChildren();
    this.words.replaceChildren();
    this.plots = plotPreview(preview, this.previews);
    this.numbers.replaceChildren(...describeNumbers(forecast));
  }

  showProblem(message) {
    const { path, text } = locateProblem(message, this.method);
    const field = this.form.showProblem(path, message ? text : "");
    write(this.problem, !message ? "" : field ? `Not valid yet; the field is marked below: ${message}.`.replace("..", ".") : message);
  }

  async assess() {
    this.words.replaceChildren(element("li", { className: "soft" }, "Assessing the strokes, for some seconds …"));
    try {
      this.words.replaceChildren(...(await assess(this.method)).map((line) => element("li", {}, line)));
    } catch (problem) {
      this.words.replaceChildren(element("li", { className: "problem" }, problem.after("Not assessed")));
    }
  }

  /** Stores a valid method as the next version of its name. */
  async store() {
    if (!(await this.check())) {
      this.form.place.querySelector("[aria-invalid]")?.focus();
      return;
    }
    try {
      const stored = await start("methods", this.method);
      sessionStorage.removeItem(this.key);
      this.onStored(stored);
    } catch (problem) {
      this.showProblem(problem.message);
    }
  }

  discard() {
    sessionStorage.removeItem(this.key);
    this.showForm(structuredClone(this.stored));
    this.json.value = JSON.stringify(this.method, null, 2);
    write(this.note, "The draft was discarded.");
    this.check();
  }

  /** Shows form and forecast in changed units. */
  relabel() {
    if (!this.form) return;
    this.showForm(this.method);
    this.check();
  }

  /** Ends the plots and a check that is due; the draft stays. */
  destroy() {
    clearTimeout(this.timer);
    this.isClosed = true;
    clearPlots(this.plots);
  }
}

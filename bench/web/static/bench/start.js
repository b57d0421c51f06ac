// Form that starts a run: method, specimen and operator; Resume beside it after a pause.

import { get, start } from "../common/api.js";
import { benchQuery, withBench } from "../common/bench.js";
import { byId, describeDriveKind, duration, element, write } from "../common/format.js";
import { followOperator, keepOperatorName } from "../common/session.js";
import { requestResumption } from "../runs/run_actions.js";

/** Reason why no run can be started, by state of the bench; empty if one can. */
const OBSTACLES = {
  idle: "",
  unknown: "The bench does not answer.",
  absent: "This service has no rig.",
  preparing: "A run or a setup step is being prepared.",
  running: "A run is in progress.",
  stopping: "The run is being stopped.",
  tripped: "The bench has tripped: reset it first.",
};

export class StartForm {
  constructor({ onStarted }) {
    this.onStarted = onStarted;
    this.problem = "";
    this.busy = false;
    this.state = "unknown";
    this.paused = null;
    byId("resume").addEventListener("click", () => this.resume());
    followOperator(byId("operator"));
    byId("start-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.start();
    });
    byId("start-form").addEventListener("input", () => this.show({ problem: "" }));
  }

  /** Loads the methods, the shortest first; the selection is kept. */
  async load() {
    try {
      const methods = (await get(benchQuery("methods"))).items;
      const chosen = this.method() ?? this.wanted;
      this.methods = methods.sort((a, b) => a.duration_s - b.duration_s);
      this.list(chosen);
    } catch (problem) {
      byId("methods").replaceChildren(element("p", { className: "problem" }, problem.after("The methods cannot be listed")));
    }
  }

  /** Shows the drive of the bench, which decides the methods that it can run. */
  showDrive(kind) {
    if (!kind || kind === this.driveKind) return;
    this.driveKind = kind;
    this.list(this.method());
  }

  /** Shows the latest run of the bench, which can be resumed if a pause ended it. */
  showLastRun(run) {
    this.paused = run?.paused_after ? run : null;
    this.show({});
  }

  /** Lists the methods; those for another drive are named apart, because this bench cannot run them. */
  list(chosen) {
    if (!this.methods) return;
    const fits = ({ drive_kind: kind }) => !this.driveKind || kind === this.driveKind;
    const possible = this.methods.filter(fits);
    const selected = possible.find(({ name }) => name === chosen)?.name ?? possible[0]?.name;
    const others = this.methods.filter((method) => !fits(method)).map(({ name }) => name);
    byId("methods").replaceChildren(...possible.map((method) => choice(method, method.name === selected)));
    if (!others.length) return;
    const drive = describeDriveKind(this.driveKind);
    byId("methods").append(element("p", { className: "soft" }, `Not on this bench, which commands the ${drive}: ${others.join(", ")}.`));
  }

  /** Selects a method by name, if it is listed, now or once the list is loaded. */
  choose(name) {
    this.wanted = name;
    this.list(name);
  }

  method() {
    return document.querySelector("#methods input:checked")?.value;
  }

  suggestSpecimens(names) {
    byId("known-specimens").replaceChildren(...names.map((value) => element("option", { value })));
  }

  /** Shows the state of the bench, or the error of the last attempt, next to the button. */
  show({ state = this.state, problem = this.problem }) {
    // A refusal in one state does not apply to the next one.
    this.problem = state === this.state ? problem : "";
    this.state = state;
    const obstacle = OBSTACLES[state] ?? "";
    byId("start").disabled = byId("resume").disabled = this.busy || obstacle !== "";
    byId("resume").hidden = !this.paused;
    const pause = this.paused ? `The last run was paused after ${this.paused.paused_after}; Resume continues it.` : "";
    write(byId("start-note"), this.problem || obstacle || pause);
    byId("start-note").classList.toggle("problem", this.problem !== "");
  }

  start() {
    const [method, specimen, operator] = [this.method(), byId("specimen").value.trim(), byId("operator").value.trim()];
    if (!method) return this.show({ problem: "Choose a method." });
    this.attempt("Not started", async () => {
      const run = await start("runs", withBench({ method, specimen, operator })); // returns once the run has started
      keepOperatorName(operator);
      return run;
    });
  }

  resume() {
    const { id } = this.paused;
    this.attempt("Not resumed", () => requestResumption(id));
  }

  /** Makes a request that returns a started run; the reason of its refusal is shown beside the buttons. */
  async attempt(consequence, request) {
    this.busy = true;
    this.show({ problem: "" });
    try {
      this.onStarted(await request());
    } catch (problem) {
      this.problem = problem.after(consequence);
    } finally {
      this.busy = false;
      this.show({});
    }
  }
}

function choice(method, checked) {
  const facts = [duration(method.duration_s), describeDriveKind(method.drive_kind)].filter(Boolean).join(", ");
  return element("label", { className: "choice" },
    element("input", { type: "radio", name: "method", value: method.name, checked, required: true }),
    element("span", {}, element("strong", {}, method.name), ` ${facts}`,
      element("span", { className: "soft title" }, method.title)));
}

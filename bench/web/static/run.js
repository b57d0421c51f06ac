// View of one run at an address of its own: facts, diagnosis, fit, jobs, files and report.

import { get } from "./api.js";
import { makeDriveTable, makeParameterTable } from "./fit_tables.js";
import { byId, duration, element, instant, write } from "./format.js";
import { Replay } from "./replay.js";
import { makeReport } from "./report.js";
import { RunActions } from "./run_actions.js";
import { describeFit, describeJob, describeOutcome, describeVerdict, hasReport, isFitted, mayReport } from "./run_facts.js";
import { runAddress, specimenAddress } from "./router.js";

export class RunView {
  constructor() {
    this.id = null;
    this.actions = new RunActions({ onRun: (run) => this.update(run), onNote: (id) => id === this.id && this.showFacts() });
  }

  /** Shows the run of an address: all of it, or its part `report` or `replay` alone. */
  async show({ id, part }) {
    this.replay?.destroy();
    Object.assign(this, { id, part, run: null, replay: null });
    byId("run").replaceChildren();
    write(byId("run-note"), "Loading …");
    try {
      const run = await get(`runs/${encodeURIComponent(id)}`);
      if (id !== this.id || part !== this.part) return; // another address was opened meanwhile
      this.build(run);
      await (part === "replay" ? this.openReplay(run) : this.load());
      write(byId("run-note"), "");
    } catch (problem) {
      write(byId("run-note"), problem.after("The run cannot be shown"));
    }
  }

  /** Shows a changed run, if it is the one in view; results of a new job are loaded. */
  update(run) {
    if (run.id !== this.id || !this.run) return;
    const before = this.run;
    this.run = run;
    this.showFacts();
    if (this.part !== "replay" && results(run) !== results(before)) this.load();
  }

  build(run) {
    this.run = run;
    const title = `${run.specimen || "Unnamed specimen"}, ${run.method}`;
    write(byId("view-run").querySelector("h1"), title);
    document.body.dataset.title = title;
    this.facts = element("section", { "aria-label": "Facts" });
    this.results = element("div", { className: "results" });
    this.report = element("section", { "aria-label": "Report" });
    this.recording = element("section", { "aria-label": "Replay" });
    const parts = { report: [this.report], replay: [this.recording] }[this.part] ?? [this.facts, this.results, this.report];
    byId("run").replaceChildren(this.navigation(), ...parts);
    this.showFacts();
  }

  navigation() {
    const link = (text, part) => {
      const made = element("a", { href: runAddress(this.id, part) }, text);
      if (part === this.part) made.setAttribute("aria-current", "page");
      return made;
    };
    return element("nav", { className: "parts", "aria-label": "Parts of the run" }, link("Everything", ""), link("Replay", "replay"), link("Report alone", "report"));
  }

  async openReplay(run) {
    const replay = new Replay(run, this.recording);
    this.replay = replay;
    await replay.open();
    if (this.replay !== replay) replay.destroy(); // another address was opened meanwhile
  }

  showFacts() {
    const { run } = this;
    const focused = document.activeElement?.dataset?.key;
    const jobs = run.jobs.toReversed().map((job) => element("li", {}, describeJob(job), element("small", {}, jobTimes(job))));
    const rows = {
      ...(run.specimen && { Specimen: [element("a", { className: "link", href: specimenAddress(run.specimen) }, run.specimen)] }),
      Started: [instant(run.started)],
      Duration: [duration(run.duration_s)],
      Operator: [run.operator || "not given"],
      Source: [run.source === "import" ? "import of a recording made elsewhere" : "run on this bench"],
      Outcome: describeOutcome(run),
      "Fit RMSE / noise floor": describeFit(run),
      Diagnosis: run.diagnosis ? [describeVerdict(run.diagnosis), element("small", {}, run.diagnosis.explanation)] : ["–"],
      Jobs: [jobs.length ? element("ol", {}, ...jobs) : "none"],
      Log: [element("span", { className: "path" }, run.log || "none"), ...describeIntegrity(run)],
      ...(run.continues && { Continues: [element("a", { href: runAddress(run.continues) }, `run ${run.continues}`)] }),
    };
    const list = element("dl", { className: "facts" }, ...Object.entries(rows).map(([name, content]) =>
      element("div", {}, element("dt", {}, name), element("dd", {}, ...content))));
    const buttons = element("p", { className: "actions" }, ...this.actions.files(run), ...this.actions.work(run), ...this.actions.more(run), ...this.actions.exports(run));
    this.facts.replaceChildren(element("h2", {}, "Facts"), list, buttons, this.actions.answer(run));
    if (focused) this.facts.querySelector(`[data-key="${CSS.escape(focused)}"]`)?.focus();
  }

  /** Loads fit and report; what does not exist yet is named. */
  async load() {
    const { run, part } = this;
    if (part !== "report" && isFitted(run)) await this.loadFit(run);
    if (!(part === "report" ? mayReport(run) : hasReport(run))) {
      const text = mayReport(run) ? "Report alone shows the recording; a report with a fit is made by the identification." : "A report needs a complete log.";
      this.report.replaceChildren(element("h2", {}, "Report"), element("p", { className: "soft" }, text));
      return;
    }
    const made = await makeReport(run);
    if (run.id === this.id) this.report.replaceChildren(element("h2", {}, isFitted(run) ? "Report: measured over simulated" : "Report on the recording"), ...made);
  }

  async loadFit(run) {
    const fit = await get(`runs/${encodeURIComponent(run.id)}/fit`);
    if (run.id !== this.id) return;
    const { version, seed, logs } = fit.provenance;
    const origin = [`Made by version ${version}, seed ${seed}.`, ...Object.entries(logs).map(([name, hash]) => `${name}: SHA-256 ${hash}`)];
    this.results.replaceChildren(
      element("section", { "aria-label": "Force error" }, makeDriveTable(fit)),
      element("section", { "aria-label": "Parameters" }, makeParameterTable(fit)),
      element("section", { "aria-label": "Provenance" }, element("h2", {}, "Provenance"),
        ...origin.map((text) => element("p", { className: "path" }, text))));
  }
}

/** Tells whether the log is as it was recorded, with the hash stored then. */
function describeIntegrity({ integrity, log_sha256: hash }) {
  if (!hash) return [];
  const damaged = integrity && integrity !== "intact";
  const found = damaged ? element("small", { className: "problem" }, `The log is ${integrity}; results may not be its own.`) : null;
  return [found, element("small", { className: "path" }, `SHA-256 ${hash}`)];
}

/** Identifies the results of a run, to find out whether there is a new one. */
const results = (run) => run.jobs.filter(({ state }) => state === "done").map(({ id }) => id).join();

function jobTimes({ created, finished, attempts }) {
  const end = finished ? `, ended ${instant(finished)}` : "";
  return `requested ${instant(created)}${end}${attempts > 1 ? `, ${attempts} attempts` : ""}`;
}

// View of one run at an address of its own: facts, results, records and report, the most important first.

import { get } from "../common/api.js";
import { shownBench } from "../common/bench.js";
import { byId, duration, element, instant, write } from "../common/format.js";
import { Replay } from "../live/replay.js";
import { makeReport } from "./report.js";
import { RunActions } from "./run_actions.js";
import { describeFit, describeJob, describeOutcome, describeVerdict, hasReport, isFitted, mayReport } from "./run_facts.js";
import { RunEvents } from "./run_events.js";
import { RunRecords } from "./run_records.js";
import { RunResults } from "./run_results.js";
import { ReportSignatures } from "./signatures.js";
import { runAddress, specimenAddress } from "../common/router.js";
import { factList, foldedSection } from "../common/tables.js";

export class RunView {
  /** Takes a function that receives a run that was changed here, and gives it to all views. */
  constructor({ onRun }) {
    this.id = null;
    this.actions = new RunActions({ onRun, onNote: (id) => id === this.id && this.showFacts() });
  }

  /** Shows the run of an address: all of it, or its part `report` or `replay` alone. */
  async show({ id, part }) {
    this.replay?.destroy();
    this.results?.destroy();
    Object.assign(this, { id, part, run: null, replay: null, results: null, records: null });
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
    this.records?.update(run);
    if (this.part !== "replay" && progress(run) !== progress(before)) this.load();
  }

  build(run) {
    this.run = run;
    const title = `${run.specimen || "Unnamed specimen"}, ${run.method}`;
    write(byId("view-run").querySelector("h1"), title);
    document.body.dataset.title = title;
    const parts = { report: () => [this.makeReportPlace(), this.makeSignatures(run)], replay: () => [this.makeReplayPlace()] }[this.part] ?? (() => this.makeEverything(run));
    byId("run").replaceChildren(this.navigation(), ...parts());
    this.showFacts();
  }

  makeEverything(run) {
    this.facts = element("section", { "aria-label": "Facts" });
    this.results = new RunResults();
    this.records = new RunRecords(run);
    this.events = new RunEvents(run.id);
    const { section, body } = foldedSection("Report", { whenOpened: () => this.loadReport() });
    this.report = body;
    return [this.facts, ...this.results.sections, ...this.records.sections, this.events.section, section, this.makeSignatures(run)];
  }

  makeSignatures(run) {
    return new ReportSignatures(`runs/${encodeURIComponent(run.id)}`, `run ${run.id}`).section;
  }

  makeReportPlace() {
    this.report = element("section", { "aria-label": "Report" });
    return this.report;
  }

  makeReplayPlace() {
    this.recording = element("section", { "aria-label": "Replay" });
    return this.recording;
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
    if (!this.records) return;
    const { run } = this;
    const focused = document.activeElement?.dataset?.key;
    const jobs = run.jobs.toReversed().map((job) => element("li", {}, describeJob(job), element("small", {}, jobTimes(job))));
    const list = factList({
      ...(run.specimen && { Specimen: [element("a", { className: "link", href: specimenAddress(run.specimen) }, run.specimen)] }),
      ...(run.trashed && { Trash: [element("strong", { className: "attention" }, `In the trash since ${instant(run.trashed)}. Restore moves it back.`)] }),
      Started: [instant(run.started)],
      Duration: [duration(run.duration_s)],
      Operator: [run.operator || "not given"],
      Source: [run.source === "import" ? "import of a recording made elsewhere" : `run on ${(shownBench() && run.bench) || "this bench"}`],
      Outcome: describeOutcome(run),
      "Fit RMSE / noise floor": describeFit(run),
      Diagnosis: [run.diagnosis ? describeVerdict(run.diagnosis) : "–"],
      Jobs: [jobs.length ? element("ol", {}, ...jobs) : "none"],
      Log: [element("span", { className: "path" }, run.log || "none"), ...describeIntegrity(run)],
      ...(run.continues && { Continues: [element("a", { href: runAddress(run.continues) }, `run ${run.continues}`)] }),
    });
    const buttons = element("p", { className: "actions" }, ...this.actions.files(run), ...this.actions.work(run), ...this.actions.more(run), ...this.actions.exports(run));
    this.facts.replaceChildren(element("h2", {}, "Facts"), list, buttons, this.actions.answer(run));
    if (focused) this.facts.querySelector(`[data-key="${CSS.escape(focused)}"]`)?.focus();
  }

  /** Loads what a change of the jobs can have changed. */
  async load() {
    const { run, results, records, events } = this;
    if (this.part === "report") await this.loadReport();
    else await Promise.all([results.load(run), records.load(), events.load()]);
    if (this.report?.closest("details")?.open) await this.loadReport();
  }

  /** Loads the report; what does not exist yet is named. */
  async loadReport() {
    const { run, part, report } = this;
    if (!(part === "report" ? mayReport(run) : hasReport(run))) {
      const text = mayReport(run) ? "Report alone shows the recording; a report with a fit is made by the identification." : "A report needs a complete log.";
      report.replaceChildren(element("p", { className: "soft" }, text));
      return;
    }
    const heading = element("h2", {}, isFitted(run) ? "Report: measured over simulated" : "Report on the recording");
    const made = await makeReport(run);
    report.replaceChildren(...(part === "report" ? [heading] : []), ...made);
  }

  /** Shows the results in changed units. */
  relabel() {
    this.results?.relabel();
  }
}

/** Tells whether the log is as it was recorded, with the hash stored then. */
function describeIntegrity({ integrity, log_sha256: hash }) {
  if (!hash) return [];
  const damaged = integrity && integrity !== "intact";
  const found = damaged ? element("small", { className: "problem" }, `The log is ${integrity}; results may not be its own.`) : null;
  return [found, element("small", { className: "path" }, `SHA-256 ${hash}`)];
}

/** Identifies states of the run and its jobs, to find out whether there is a new result or another reason why not. */
const progress = (run) => [run.state, run.trashed, ...run.jobs.map(({ id, state }) => `${id} ${state}`)].join();

function jobTimes({ created, finished, attempts }) {
  const end = finished ? `, ended ${instant(finished)}` : "";
  return `requested ${instant(created)}${end}${attempts > 1 ? `, ${attempts} attempts` : ""}`;
}

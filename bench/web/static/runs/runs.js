// Table of the runs with outcome, fit, jobs and actions.

import { get } from "../common/api.js";
import { shownBench } from "../common/bench.js";
import { byId, duration, element, instant, localTime, write, zone } from "../common/format.js";
import { RunActions } from "./run_actions.js";
import { describeFit, describeJob, describeOutcome, describeVerdict, isUnfinished } from "./run_facts.js";
import { runAddress, specimenAddress } from "../common/router.js";
import { RunSelection } from "./run_selection.js";

const PAGE = 20;

export class RunList {
  /** Takes functions that receive the known specimens, and every changed run. */
  constructor({ onSpecimens, onRun }) {
    Object.assign(this, { onSpecimens, onRun });
    this.runs = new Map();
    this.next = null;
    this.conditions = {};
    this.selection = new RunSelection();
    this.actions = new RunActions({ onRun: (run) => this.update(run), onNote: () => this.show() });
    byId("older").addEventListener("click", () => this.load(this.next));
  }

  /** Lists the runs that meet conditions; all without any. */
  search(conditions) {
    if (JSON.stringify(conditions) === JSON.stringify(this.conditions)) return;
    this.conditions = conditions;
    this.runs.clear();
    this.next = null;
    this.load();
  }

  get isSearch() {
    return Object.keys(this.conditions).length > 0;
  }

  /** Sentence for a list without runs. */
  describeEmpty() {
    if (!this.isSearch) return "No runs yet.";
    return Object.keys(this.conditions).join() === "trash" ? "The trash is empty." : "No run meets all conditions.";
  }

  /** Loads the newest page, or the page before a run. */
  async load(before = null) {
    const { conditions } = this;
    try {
      const query = new URLSearchParams({ limit: PAGE, ...conditions, ...(before && { before }) });
      const { items, next } = await get(`runs?${query}`);
      if (conditions !== this.conditions) return; // another search was made meanwhile
      for (const run of items) this.runs.set(run.id, run);
      // A reload of the newest page keeps the position in the older ones.
      if (before || this.runs.size <= PAGE) this.next = next;
      this.show();
    } catch (problem) {
      write(byId("runs-note"), problem.after("The runs cannot be listed"));
    }
  }

  /** Shows a changed run. */
  update(run) {
    // A search shows what it has found; a run that starts meanwhile is found by the next search.
    if (!this.isSearch || this.runs.has(run.id)) this.runs.set(run.id, run);
    this.show();
    this.onRun(run);
  }

  /** Shows a changed job. */
  updateJob(job) {
    const run = this.runs.get(job.run);
    if (!run) return;
    const others = run.jobs.filter(({ id }) => id !== job.id);
    this.update({ ...run, jobs: [...others, job] });
    if (!isUnfinished(job)) this.refresh(run);
  }

  async refresh(run) {
    try {
      this.update(await get(`runs/${encodeURIComponent(run.id)}`));
    } catch (problem) {
      this.actions.note(run, problem.message);
    }
  }

  show() {
    const runs = [...this.runs.values()].sort((a, b) => (a.started < b.started ? 1 : -1));
    const focused = document.activeElement?.dataset?.key;
    byId("runs").replaceChildren(...runs.map((run) => this.row(run)));
    if (focused) byId("runs").querySelector(`[data-key="${CSS.escape(focused)}"]`)?.focus();
    this.selection.show();
    write(byId("runs-zone"), `(${zone()})`);
    write(byId("runs-note"), runs.length ? "" : this.describeEmpty());
    write(byId("runs-title"), this.isSearch ? "Found, newest first" : "Newest first");
    byId("older").hidden = !this.next;
    this.onSpecimens([...new Set(runs.map(({ specimen }) => specimen).filter(Boolean))]);
  }

  /** Link to the specimen of a run. */
  specimen({ id, specimen }) {
    if (!specimen) return "unnamed";
    const link = element("a", { className: "link", href: specimenAddress(specimen) }, specimen);
    link.dataset.key = `${id}/specimen`;
    return link;
  }

  row(run) {
    const link = element("a", { href: runAddress(run.id) }, localTime(run.started));
    link.dataset.key = `${run.id}/open`;
    return element("tr", {},
      element("td", {}, this.selection.box(run)),
      element("th", { scope: "row", className: "number" }, link, element("small", {}, run.operator), shownBench() && run.bench ? element("small", {}, `on ${run.bench}`) : null),
      element("td", {}, this.specimen(run), element("small", {}, `${run.method}, ${duration(run.duration_s)}`)),
      element("td", {}, ...describeOutcome(run), run.trashed ? element("small", { className: "attention" }, `In the trash since ${instant(run.trashed)}`) : null),
      element("td", {}, ...describeFit(run), run.diagnosis ? element("small", {}, `Gap ${describeVerdict(run.diagnosis)}`) : null),
      element("td", {}, ...run.jobs.toReversed().map((job) => element("small", { className: "job" }, describeJob(job)))),
      element("td", { className: "actions" }, ...this.actions.files(run), ...this.actions.work(run), this.actions.answer(run)));
  }
}

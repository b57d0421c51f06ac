// View of one specimen at an address of its own: facts, trend with its cause, history of its runs.

import { get, getTag } from "../common/api.js";
import { byId, duration, element, localTime, write, zone } from "../common/format.js";
import { runAddress, specimenAddress } from "../common/router.js";
import { rowTable } from "../common/tables.js";
import { describeFit, describeOutcome, describeVerdict, isUnfinished } from "../runs/run_facts.js";
import { SpecimenFacts } from "./specimen_facts.js";
import { SpecimenTrend } from "./specimen_trend.js";
import { TrendRequest } from "./trend_request.js";

const MOST_RUNS = 200;

export class SpecimenView {
  constructor() {
    this.serial = null;
  }

  /** Shows the specimen of an address with the chosen quantity of its trend. */
  async show({ id, query }) {
    this.parts?.trend.destroy();
    Object.assign(this, { serial: id, parts: null, runs: [], document: null, parameters: [] });
    this.choice = { quantity: query.get("quantity"), over: query.get("over") };
    byId("specimen-parts").replaceChildren();
    write(byId("view-specimen").querySelector("h1"), `Specimen ${id}`);
    document.body.dataset.title = `Specimen ${id}`;
    write(byId("specimen-note"), "Loading …");
    await this.reload();
  }

  /** Loads the specimen in view again, with all its runs and results. */
  async reload() {
    const { serial } = this;
    if (!serial || byId("view-specimen").hidden) return;
    const path = `specimens/${encodeURIComponent(serial)}`;
    const query = new URLSearchParams({ specimen: serial, limit: MOST_RUNS });
    try {
      const [{ data, etag }, { items, next }] = await Promise.all([getTag(path), get(`runs?${query}`)]);
      if (serial !== this.serial) return; // another address was opened meanwhile
      Object.assign(this, { runs: items, hasOlder: Boolean(next) });
      this.build();
      this.parts.facts.show(data, etag);
      this.showHistory();
      write(byId("specimen-note"), "");
      await this.loadResults();
    } catch (problem) {
      if (serial === this.serial) write(byId("specimen-note"), problem.after("The specimen cannot be shown"));
    }
  }

  build() {
    if (this.parts) return;
    const request = new TrendRequest((job) => this.updateJob(job));
    this.parts = {
      request,
      facts: new SpecimenFacts(),
      trend: new SpecimenTrend(request.place, (choice) => this.keepChoice(choice)),
      history: element("section", { "aria-label": "History" }),
    };
    const { facts, trend, history } = this.parts;
    byId("specimen-parts").replaceChildren(facts.place, trend.place, history);
  }

  /** Loads the trend, if there is one, and the parameters of the fits. */
  async loadResults() {
    const { serial } = this;
    const path = `specimens/${encodeURIComponent(serial)}`;
    const hasTrend = this.runs.some(({ jobs }) => jobs.some(({ kind, state }) => kind === "trend" && state === "done"));
    const [trend, { items }] = await Promise.all([
      hasTrend ? get(`${path}/trend`).catch((problem) => this.explainMissing(problem)) : null, get(`${path}/parameters`),
    ]);
    if (serial !== this.serial) return;
    // While a new trend is computed, the service returns none; the one in view stays.
    Object.assign(this, { document: trend ?? this.document, parameters: items });
    this.showTrend();
  }

  explainMissing(problem) {
    if (problem.status === 404) return null;
    throw problem;
  }

  /** Shows a changed run, if it is one of the specimen in view. */
  update(run) {
    if (!this.parts || run.specimen !== this.serial) return;
    this.runs = [run, ...this.runs.filter(({ id }) => id !== run.id)].sort((a, b) => (a.started < b.started ? 1 : -1));
    this.showHistory();
    this.parts.request.update(this.serial, this.runs);
  }

  /** Shows a changed job; a result that is done is loaded. */
  updateJob(job) {
    const run = this.runs?.find(({ id }) => id === job.run);
    if (!run || !this.parts) return;
    this.update({ ...run, jobs: [...run.jobs.filter(({ id }) => id !== job.id), job] });
    if (!isUnfinished(job)) this.reload();
  }

  showTrend() {
    const { document: trend, parameters, runs, choice } = this;
    this.parts.trend.show({ trend, parameters, runs, choice });
    this.parts.request.update(this.serial, runs);
  }

  /** Keeps the choice in the address, so that it can be reloaded and sent. */
  keepChoice(choice) {
    this.choice = choice;
    history.replaceState(null, "", `${specimenAddress(this.serial)}?${new URLSearchParams(choice)}`);
  }

  showHistory() {
    const rows = this.runs.map((run) => element("tr", {},
      element("th", { scope: "row", className: "number" }, element("a", { href: runAddress(run.id) }, localTime(run.started))),
      element("td", {}, run.method, element("small", {}, duration(run.duration_s))),
      element("td", {}, ...describeOutcome(run)),
      element("td", {}, run.diagnosis ? describeVerdict(run.diagnosis) : "not diagnosed"),
      element("td", {}, ...describeFit(run))));
    const heads = [`Started (${zone()})`, "Method", "Outcome", "Verdict", "Fit RMSE / noise floor"];
    const all = element("a", { className: "button", href: `#/runs?${new URLSearchParams({ specimen: this.serial })}` }, "Search these runs");
    const note = this.hasOlder ? element("p", { className: "note" }, `Only the newest ${MOST_RUNS} runs are shown.`) : null;
    const title = "Runs, newest first";
    this.parts.history.replaceChildren(element("h2", {}, title), ...(note ? [note] : []),
      rowTable(title, heads, rows),
      element("p", { className: "actions" }, all));
  }

  /** Shows the limits of the specimen in changed units. */
  relabel() {
    this.parts?.facts.relabel();
  }
}

// Request of a specimen's trend: whether there is one, which runs it lacks, progress of its job.

import { post, start } from "../common/api.js";
import { element, instant, write } from "../common/format.js";
import { need } from "../common/rights.js";
import { describeJob, isUnfinished } from "../runs/run_facts.js";

const LEAST_RUNS = 3;
const MOST_RUNS = 50;
const DAMAGED = ["changed", "missing"];

const isUsable = (run) => ["clean", "lossy"].includes(run.outcome) && run.log_sha256 && !DAMAGED.includes(run.integrity);

/** Newest job of a trend among those of the runs; a trend belongs to the newest run that it reads. */
export const findTrendJob = (runs) => runs.flatMap(({ jobs }) => jobs).filter(({ kind }) => kind === "trend")
  .sort((a, b) => (a.created < b.created ? 1 : -1))[0] ?? null;

export class TrendRequest {
  /** Takes a function that receives each job that was requested or cancelled here. */
  constructor(onJob) {
    this.onJob = onJob;
    this.status = element("p", { role: "status" });
    this.progress = element("progress", { max: 1, "aria-label": "Progress of the trend" });
    this.button = need("analyse", element("button", { type: "button" }));
    this.button.addEventListener("click", () => this.act());
    this.place = element("div", { className: "request" }, this.status, this.progress, this.button);
  }

  /** Shows the state for the runs of a specimen, the newest first. */
  update(serial, runs) {
    const usable = runs.filter(isUsable).slice(0, MOST_RUNS);
    const job = findTrendJob(runs);
    Object.assign(this, { serial, job, isRunning: job !== null && isUnfinished(job) });
    const isNew = job?.state !== "done" || countMissing(job, usable) > 0;
    write(this.status, describe(job, usable));
    this.progress.hidden = !this.isRunning;
    this.progress.value = job?.fraction ?? 0;
    this.button.hidden = !this.isRunning && (usable.length < LEAST_RUNS || !isNew);
    write(this.button, this.isRunning ? "Cancel the computation" : "Compute the trend");
  }

  async act() {
    const path = `specimens/${encodeURIComponent(this.serial)}/trend`;
    try {
      this.onJob(await (this.isRunning ? post(`jobs/${encodeURIComponent(this.job.id)}/cancel`) : start(path)));
    } catch (problem) {
      write(this.status, problem.after(this.isRunning ? "Not cancelled" : "Not requested"));
    }
  }
}

const countMissing = (job, usable) => usable.filter(({ id }) => !job.settings.runs?.includes(id)).length;

function describe(job, usable) {
  const runs = `${usable.length} run${usable.length === 1 ? "" : "s"} with a complete log`;
  if (job && isUnfinished(job)) return `The trend is being computed: ${describeJob(job)}.`;
  if (job?.state === "done") {
    const missing = countMissing(job, usable);
    const more = missing ? ` It does not contain ${missing} newer run${missing === 1 ? "" : "s"}.` : "";
    return `Trend over ${job.settings.runs?.length} runs, computed ${instant(job.finished)} by version ${job.version || "unknown"}.${more}`;
  }
  if (usable.length < LEAST_RUNS) return `A trend needs ${LEAST_RUNS} runs with a complete log; this specimen has ${usable.length}.`;
  const reason = job ? `The latest attempt has ended without a trend: ${describeJob(job)}. ` : "";
  return `${reason}There is no trend over the ${runs} yet. Its computation diagnoses each run, then fits the effects that were `
    + "found to all of them, which takes minutes for each run.";
}

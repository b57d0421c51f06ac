// View of the queue: running jobs first, then the queued ones in their order, each with a button that cancels it.

import { isAsking } from "../account/sign_in.js";
import { get, post } from "../common/api.js";
import { byId, write } from "../common/format.js";
import { JobRow } from "./job_row.js";

const PERIOD_MS = 2_000;
/** Number of jobs that one request returns, and that the view shows. */
const SHOWN = 200;
const PATH = `jobs?state=queued&state=running&limit=${SHOWN}`;

/** Order of two jobs: a running one has no position in the queue. */
const compare = (a, b) => (a.position ?? 0) - (b.position ?? 0) || Date.parse(a.created) - Date.parse(b.created);

/** Returns all running and queued jobs. The service lists the newest first, so the next ones are on its last page. */
async function fetchJobs() {
  const jobs = [];
  for (let next = ""; next !== null;) {
    const page = await get(`${PATH}${next && `&before=${encodeURIComponent(next)}`}`);
    jobs.push(...page.items);
    next = page.next;
  }
  return jobs.sort(compare);
}

function describeNumber(number) {
  if (!number) return "No job is running or queued.";
  return number > SHOWN ? `${number} jobs are running or queued; the first ${SHOWN} are listed.` : "";
}

export class JobView {
  /** `clock` is the clock of the service, on which the age of a job is judged. */
  constructor({ clock }) {
    this.clock = clock;
    this.rows = new Map();
    setInterval(() => this.follow(), PERIOD_MS);
  }

  show() {
    write(byId("jobs-answer"), "");
    return this.load();
  }

  /** Requests the queue while the view is visible, and one request at a time. */
  follow() {
    if (!byId("view-jobs").hidden && !document.hidden && !this.isLoading && !isAsking()) this.load();
  }

  async load() {
    this.isLoading = true;
    try {
      const jobs = await fetchJobs();
      this.list(jobs.slice(0, SHOWN));
      write(byId("jobs-note"), describeNumber(jobs.length));
    } catch (problem) {
      write(byId("jobs-note"), problem.after("The jobs cannot be listed"));
    } finally {
      this.isLoading = false;
    }
  }

  /** Shows the jobs. The row of a job stays, so that no press is lost and the focus does not move. */
  list(jobs) {
    const present = new Set(jobs.map(({ id }) => id));
    for (const id of this.rows.keys()) if (!present.has(id)) this.rows.delete(id);
    for (const job of jobs) this.update(job);
    const wanted = jobs.map(({ id }) => this.rows.get(id).element);
    const body = byId("jobs");
    if (wanted.length === body.children.length && wanted.every((row, k) => row === body.children[k])) return;
    const focused = body.contains(document.activeElement) ? document.activeElement : null;
    body.replaceChildren(...wanted);
    if (focused) (focused.isConnected ? focused : byId("view-jobs").querySelector("h1")).focus();
  }

  update(job) {
    if (!this.rows.has(job.id)) this.rows.set(job.id, new JobRow(job, () => this.cancel(job)));
    this.rows.get(job.id).show(job, this.clock.age(Date.parse(job.created) / 1000));
  }

  async cancel({ id, kind, run }) {
    try {
      await post(`jobs/${encodeURIComponent(id)}/cancel`);
      await this.load();
      write(byId("jobs-answer"), `The cancellation of ${kind} of run ${run} was requested. Retry in the view of the run repeats it.`);
    } catch (problem) {
      write(byId("jobs-answer"), problem.after("Not cancelled"));
    }
  }
}

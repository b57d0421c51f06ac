// Actions on a run: files, identification, diagnosis, repair. Each leaves a visible answer beside the run.

import { get, post, remove, saveFile, start } from "../common/api.js";
import { shownBench } from "../common/bench.js";
import { selectionAddress } from "../compare/compare_address.js";
import { ask, askForText } from "../common/dialogs.js";
import { element, instant } from "../common/format.js";
import { canResume, hasEnded, isFitted, isUnfinished, mayReport, mayRetry } from "./run_facts.js";
import { need } from "../common/rights.js";
import { addressOf, runAddress } from "../common/router.js";

const encode = encodeURIComponent;
/** Rights that the buttons need, by the first word of their keys; files need none beyond reading. */
const NEEDED = {
  restore: "manage_runs", repair: "manage_runs", trash: "manage_runs", resume: "operate",
  identify: "analyse", diagnose: "analyse", cancel: "analyse", retry: "analyse", integrity: "analyse",
};
const EXPORTS = [
  ["CSV", "export?format=csv"], ["Parquet", "export?format=parquet"], ["MAT", "export?format=mat"],
  ["PDF report", "report?format=pdf"], ["XLSX report", "report?format=xlsx"],
];

export class RunActions {
  /** Takes functions that receive a changed run, and the id of a run with a new note. */
  constructor({ onRun, onNote }) {
    Object.assign(this, { onRun, onNote });
    this.notes = new Map();
  }

  /** Answer to the latest action on a run. */
  answer(run) {
    return element("small", { role: "status" }, this.notes.get(run.id) ?? "");
  }

  /** Links and buttons for the files of a run. */
  files(run) {
    const report = mayReport(run)
      ? element("a", { className: "button", href: runAddress(run.id, "report"), "aria-label": `Report of ${name(run)}` }, "Report")
      : null;
    const replay = hasEnded(run)
      ? [element("a", { className: "button", href: runAddress(run.id, "replay"), "aria-label": `Replay of ${name(run)}` }, "Replay")]
      : [];
    const made = [...replay, this.button(run, "log", "Log", () => this.save(run, "log"))];
    if (isFitted(run)) made.push(this.button(run, "fit", "Fit", () => this.save(run, "fit")));
    return report ? [report, ...made] : made;
  }

  /** Buttons that save the samples and the report of a complete log in the formats of other tools. */
  exports(run) {
    return run.log_sha256 ? EXPORTS.map(([text, part]) => this.button(run, part, text, () => this.save(run, part))) : [];
  }

  /** Button that starts, cancels or repairs, by the state of the run. */
  work(run) {
    if (run.trashed) return [this.button(run, "restore", "Restore", () => this.restore(run))];
    const unfinished = run.jobs.filter(isUnfinished);
    if (unfinished.length) return unfinished.map((job) => this.button(run, `cancel-${job.id}`, `Cancel ${job.kind}`, () => this.cancel(run, job)));
    if (run.state === "truncated") return [this.button(run, "repair", "Repair log", () => this.repair(run))];
    if (!hasEnded(run)) return [];
    const made = [this.button(run, "identify", "Identify", () => this.identify(run))];
    if (isFitted(run)) made.push(this.button(run, "diagnose", "Diagnose", () => this.diagnose(run)));
    return made;
  }

  /** Further buttons of the view of one run: resumption, retry of failed jobs, check of the log, trash. */
  more(run) {
    if (run.trashed) return [];
    const made = run.jobs.filter((job) => mayRetry(job)).map((job) =>
      this.button(run, `retry-${job.id}`, `Retry ${job.kind} …`, () => this.retry(run, job)));
    if (run.log_sha256) made.push(element("a", { className: "button", href: selectionAddress([run.id]) }, "Compare with …"));
    if (run.log_sha256) made.push(this.button(run, "integrity", "Check log", () => this.checkLog(run)));
    if (canResume(run)) made.push(this.button(run, "resume", "Resume", () => this.resume(run)));
    if (run.state !== "running") made.push(this.button(run, "trash", "Move to trash …", () => this.trash(run)));
    return made;
  }

  button(run, key, text, act) {
    const button = element("button", { type: "button", "aria-label": `${text}: ${name(run)}` }, text);
    button.dataset.key = `${run.id}/${key}`;
    button.addEventListener("click", act);
    const right = NEEDED[key.split("-")[0]];
    return right ? need(right, button) : button;
  }

  note(run, text) {
    this.notes.set(run.id, text);
    this.onNote(run.id);
  }

  /** Saves a file of a run; some are made at their request. */
  async save(run, part) {
    this.note(run, "The file is fetched …");
    try {
      this.note(run, `${await saveFile(`runs/${encode(run.id)}/${part}`)} was saved.`);
    } catch (problem) {
      this.note(run, problem.after("Not saved"));
    }
  }

  async identify(run) {
    await this.attempt(run, "Not requested", async () => {
      const job = await start(`runs/${encode(run.id)}/identify`);
      return job.state === "done"
        ? `This fit exists already, made ${instant(job.finished)}; nothing was computed again.`
        : "The identification was requested.";
    });
  }

  diagnose(run) {
    return this.attempt(run, "Not requested", async () => {
      const job = await start(`runs/${encode(run.id)}/diagnose`);
      return job.state === "done"
        ? `This diagnosis exists already, made ${instant(job.finished)}; nothing was computed again.`
        : "The diagnosis was requested.";
    });
  }

  /** Queues a failed or cancelled job again, with the reason that the person gives. */
  async retry(run, job) {
    const texts = [`The job ${job.kind} is ${job.state}${job.error && `: ${job.error}`}. The reason is recorded with it.`];
    const reason = await askForText({ title: `Repeat the job ${job.kind}?`, texts, label: "Reason for the repetition", action: "Retry" });
    if (!reason) return;
    await this.attempt(run, "Not requested", async () => {
      await start(`jobs/${encode(job.id)}/retry`, { reason });
      return `The job ${job.kind} was queued again.`;
    });
  }

  checkLog(run) {
    return this.attempt(run, "Not checked", async () => {
      const { integrity, recorded_sha256: hash } = await post(`runs/${encode(run.id)}/integrity`);
      return integrity === "intact" ? `The log is as it was recorded, SHA-256 ${hash}.` : `The log is ${integrity}: restore it from a backup.`;
    });
  }

  resume(run) {
    return this.attempt(run, "Not resumed", async () => {
      const next = await requestResumption(run.id);
      this.onRun(next);
      location.hash = next.bench && shownBench() ? addressOf(next.bench, "#/bench") : "#/bench";
      return "The run was resumed; the new run continues it.";
    });
  }

  cancel(run, job) {
    return this.attempt(run, "Not cancelled", async () => {
      await post(`jobs/${encode(job.id)}/cancel`);
      return "The job was cancelled.";
    });
  }

  repair(run) {
    return this.attempt(run, "Not repaired", async () => {
      await post(`runs/${encode(run.id)}/salvage`);
      return "The log was repaired; the original is kept beside it.";
    });
  }

  /** Moves a run to the trash after a question; nothing is deleted. */
  async trash(run) {
    const texts = [
      `The ${name(run)} of ${run.specimen || "an unnamed specimen"} and its log move to the trash, and its jobs are cancelled.`,
      "Nothing is deleted. Restore in this view moves it back.",
    ];
    if (!(await ask({ title: "Move this run to the trash?", texts, action: "Move to trash" }))) return;
    await this.attempt(run, "Not moved", async () => {
      await remove(`runs/${encode(run.id)}`);
      return "The run is in the trash.";
    });
  }

  restore(run) {
    return this.attempt(run, "Not restored", async () => {
      await post(`runs/${encode(run.id)}/restore`);
      return "The run was restored.";
    });
  }

  async attempt(run, failure, act) {
    try {
      const answer = await act();
      this.onRun(await get(`runs/${encode(run.id)}`));
      this.note(run, answer);
    } catch (problem) {
      this.note(run, problem.after(failure));
    }
  }
}

/** Requests the run that continues another one after its last checkpoint; returns it once it has started. */
export const requestResumption = (id) => start(`runs/${encode(id)}/resume`);

const name = (run) => `run of ${instant(run.started)}`;

// Actions on a run: files, identification, diagnosis, repair. Each leaves a visible answer beside the run.

import { file, get, post } from "./api.js";
import { element, instant } from "./format.js";
import { hasEnded, hasReport, isFitted, isUnfinished } from "./run_facts.js";
import { runAddress } from "./router.js";

const encode = encodeURIComponent;

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
    const report = hasReport(run)
      ? element("a", { className: "button", href: runAddress(run.id, "report"), "aria-label": `Report of ${name(run)}` }, "Report")
      : null;
    const made = [this.button(run, "log", "Log", () => this.save(run, "log"))];
    if (isFitted(run)) made.push(this.button(run, "fit", "Fit", () => this.save(run, "fit")));
    return report ? [report, ...made] : made;
  }

  /** Button that starts, cancels or repairs, by the state of the run. */
  work(run) {
    const unfinished = run.jobs.filter(isUnfinished);
    if (unfinished.length) return unfinished.map((job) => this.button(run, `cancel-${job.id}`, "Cancel", () => this.cancel(run, job)));
    if (run.state === "truncated") return [this.button(run, "repair", "Repair log", () => this.repair(run))];
    if (!hasEnded(run)) return [];
    return [this.button(run, "identify", "Identify", () => this.identify(run))];
  }

  button(run, key, text, act) {
    const button = element("button", { type: "button", "aria-label": `${text}: ${name(run)}` }, text);
    button.dataset.key = `${run.id}/${key}`;
    button.addEventListener("click", act);
    return button;
  }

  note(run, text) {
    this.notes.set(run.id, text);
    this.onNote(run.id);
  }

  /** Saves a file of a run. */
  async save(run, part) {
    try {
      const { blob, name: fileName } = await file(`runs/${encode(run.id)}/${part}`);
      const address = URL.createObjectURL(blob);
      element("a", { href: address, download: fileName }).click();
      setTimeout(() => URL.revokeObjectURL(address), 60_000);
      this.note(run, `${fileName} was saved.`);
    } catch (problem) {
      this.note(run, problem.after(`No ${part}`));
    }
  }

  async identify(run) {
    await this.attempt(run, "Not requested", async () => {
      const job = await post(`runs/${encode(run.id)}/identify`);
      return job.state === "done"
        ? `This fit exists already, made ${instant(job.finished)}; nothing was computed again.`
        : "The identification was requested.";
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

const name = (run) => `run of ${instant(run.started)}`;

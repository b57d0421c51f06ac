// List of the runs with outcome, fit, files and jobs.

import { file, get, post } from "./api.js";
import { byId, duration, element, fixed, instant, write } from "./format.js";

const PAGE = 20;
const OUTCOMES = { clean: "good", lossy: "fair", truncated: "fair", incomplete: "bad" };
const UNFINISHED = ["queued", "running"];

export class RunList {
  constructor({ onSpecimens }) {
    this.onSpecimens = onSpecimens;
    this.runs = new Map();
    this.notes = new Map();
    this.next = null;
    byId("older").addEventListener("click", () => this.load(this.next));
  }

  /** Loads the newest page, or the page before a run. */
  async load(before = null) {
    try {
      const query = new URLSearchParams({ limit: PAGE, ...(before && { before }) });
      const { items, next } = await get(`runs?${query}`);
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
    this.runs.set(run.id, run);
    this.show();
  }

  /** Shows a changed job. */
  updateJob(job) {
    const run = this.runs.get(job.run);
    if (!run) return;
    const others = run.jobs.filter(({ id }) => id !== job.id);
    this.update({ ...run, jobs: [...others, job] });
    if (!UNFINISHED.includes(job.state)) this.refresh(run.id);
  }

  async refresh(id) {
    try {
      this.update(await get(`runs/${encodeURIComponent(id)}`));
    } catch (problem) {
      this.note(id, problem.message);
    }
  }

  show() {
    const runs = [...this.runs.values()].sort((a, b) => (a.started < b.started ? 1 : -1));
    const focused = document.activeElement?.dataset?.key;
    byId("runs").replaceChildren(...runs.map((run) => this.row(run)));
    if (focused) byId("runs").querySelector(`[data-key="${CSS.escape(focused)}"]`)?.focus();
    write(byId("runs-note"), runs.length ? "" : "No runs yet.");
    byId("older").hidden = !this.next;
    this.onSpecimens([...new Set(runs.map(({ specimen }) => specimen).filter(Boolean))]);
  }

  row(run) {
    return element("tr", {},
      element("th", { scope: "row" }, ...instant(run.started).split(" ").map(whole), element("small", {}, run.operator)),
      element("td", {}, run.specimen || "unnamed", element("small", {}, `${run.method}, ${duration(run.duration_s)}`)),
      outcome(run), fit(run), this.files(run), this.identification(run));
  }

  files(run) {
    const cell = element("td", { className: "actions files" });
    for (const [name, exists] of [["log", true], ["fit", fitted(run)], ["report", fitted(run)]]) {
      const label = `${name[0].toUpperCase()}${name.slice(1)} of the run of ${instant(run.started)}`;
      cell.append(this.button(run, name, name, exists, () => this.open(run, name), label));
    }
    return cell;
  }

  identification(run) {
    const job = run.jobs.at(-1);
    const id = encodeURIComponent(run.id);
    let button = this.button(run, "job", "Identify", ended(run), () => this.attempt(run, "Not requested", `runs/${id}/identify`));
    if (job && UNFINISHED.includes(job.state)) {
      const path = `jobs/${encodeURIComponent(job.id)}/cancel`;
      button = this.button(run, "job", "Cancel", true, () => this.attempt(run, "Not cancelled", path));
    } else if (run.state === "truncated") {
      button = this.button(run, "job", "Salvage", true, () => this.attempt(run, "Not salvaged", `runs/${id}/salvage`));
    }
    return element("td", { className: "actions" },
      button, job ? describeJob(job) : "",
      element("small", { className: "problem", role: "status" }, this.notes.get(run.id) ?? ""));
  }

  button(run, key, text, enabled, act, label = `${text}: run of ${instant(run.started)}`) {
    const button = element("button", { type: "button", disabled: !enabled, "aria-label": label }, text);
    button.dataset.key = `${run.id}/${key}`;
    button.addEventListener("click", act);
    return button;
  }

  note(id, text) {
    this.notes.set(id, text);
    this.show();
  }

  /** Opens the report in a new tab; saves logs and fits. */
  async open(run, name) {
    // The tab is opened now, because browsers allow it only during a click and the file arrives later.
    const tab = name === "report" ? window.open("", "_blank") : null;
    try {
      const { blob, name: fileName } = await file(`runs/${encodeURIComponent(run.id)}/${name}`);
      const address = URL.createObjectURL(blob);
      if (tab) tab.location.replace(address);
      else element("a", { href: address, download: fileName }).click();
      setTimeout(() => URL.revokeObjectURL(address), 60_000);
      this.note(run.id, "");
    } catch (problem) {
      tab?.close();
      this.note(run.id, problem.after(`No ${name}`));
    }
  }

  async attempt(run, failure, path) {
    this.notes.delete(run.id);
    try {
      await post(path);
      await this.refresh(run.id);
    } catch (problem) {
      this.note(run.id, problem.after(failure));
    }
  }
}

const ended = (run) => Boolean(run.outcome);
const fitted = (run) => run.jobs.some((job) => job.state === "done");

function outcome(run) {
  const text = (run.outcome ?? run.state).replaceAll("_", " ");
  const kind = OUTCOMES[run.outcome ?? run.state] ?? "plain";
  return element("td", {}, element("span", { className: `mark ${kind}` }, text), element("small", {}, run.reason ?? ""));
}

function fit(run) {
  const { rmse_n: rmse, noise_floor_n: floor } = run;
  if (!fitted(run)) return element("td", {}, "–");
  const ratio = floor > 0 ? `${fixed(rmse / floor, 2)} times the noise floor` : "noise floor not known";
  return element("td", {}, element("span", { className: "number" }, `${newtons(rmse)} / ${newtons(floor)}`),
    element("small", {}, run.result === "converged" ? ratio : `${ratio}; ${run.result}`));
}

const newtons = (force) => (force === null ? "–" : `${fixed(force, 2)}\u00a0N`);
/** A date or time without line break, followed by a space for one. */
const whole = (text) => element("span", { className: "number whole" }, `${text} `);

function describeJob(job) {
  return [job.state, job.state === "running" ? job.activity : "", job.error].filter(Boolean).join(": ");
}

// Bar that is always visible: state of the bench, current run, Stop, and Reset after a trip.

import { get, post } from "./api.js";
import { byId, clock, duration, fixed, write } from "./format.js";

const STATE_NAMES = {
  unknown: "No connection",
  idle: "Idle",
  preparing: "Preparing",
  running: "Running",
  stopping: "Stopping",
  tripped: "Tripped",
};
const MOVING = ["preparing", "running", "stopping"];
const STALE_S = 1.5;
const STOP_TIMEOUT_MS = 3_000;
/** Elements on which Space has another function. Stop itself is a button, so that Space on it stops as well. */
const USES_SPACE = "input, select, textarea, button, a[href], summary, [contenteditable]";

export class TopBar {
  constructor({ onState }) {
    this.onState = onState;
    this.status = null;
    this.failure = "";
    this.updatedAt = performance.now();
    this.state = null;
    byId("stop").addEventListener("click", () => this.stop());
    byId("reset").addEventListener("click", () => this.askForReset());
    byId("reset-dialog").addEventListener("close", () => byId("reset-dialog").returnValue === "reset" && this.reset());
    document.addEventListener("keydown", (event) => this.onKey(event), { capture: true });
    setInterval(() => this.show(), 100);
  }

  /** Shows a status of the agent. */
  update(status) {
    this.status = status;
    this.failure = "";
    this.updatedAt = performance.now();
    this.show();
  }

  /** Shows the reason why no status arrives. */
  showFailure(reason) {
    this.failure = reason;
  }

  /** Age [s] of the latest status. */
  get age() {
    return (performance.now() - this.updatedAt) / 1000;
  }

  get stale() {
    return this.age > STALE_S;
  }

  /** Run in progress; null during a setup step. */
  get run() {
    const run = this.status?.run;
    return run && !run.outcome ? run : null;
  }

  /** True if something may move according to the latest status. */
  get moving() {
    return MOVING.includes(this.status?.state);
  }

  show() {
    const state = this.stale || !this.status ? "unknown" : this.status.state;
    if (state !== this.state) this.enter(state);
    const word = this.status || this.stale ? STATE_NAMES[state] : "Connecting";
    write(byId("state-word"), word);
    document.title = `${word} – mrbench`;
    write(byId("bar-line"), this.line(state));
    this.showProgress(state);
  }

  enter(state) {
    this.state = state;
    byId("state").dataset.state = document.body.dataset.state = state;
    byId("state-shape").setAttribute("href", `#shape-${state}`);
    byId("reset").classList.toggle("absent", state !== "tripped");
    this.showDetail("");
    this.onState(state);
  }

  line(state) {
    const { run, trip } = this.status ?? {};
    if (state === "unknown") return this.stale ? `No data for ${fixed(this.age, 0)} s. ${this.failure}` : "";
    if (state === "tripped") return trip;
    if (state === "preparing" && !this.run) return this.status.step?.message ?? "";
    if (!run) return this.status?.step?.message ?? "Ready for a run.";
    const description = `${run.method} on ${run.specimen || "an unnamed specimen"}`;
    if (state === "idle") return `Last run: ${description}: ${[run.outcome, run.reason].filter(Boolean).join(", ")}.`;
    const by = run.operator ? ` by ${run.operator}` : "";
    return `${description}, started ${clock(new Date(run.started))}${by}`;
  }

  showProgress(state) {
    const run = MOVING.includes(state) ? this.run : null;
    const bar = byId("progress");
    bar.value = run ? Math.min(1, run.elapsed_s / run.duration_s) : 0;
    write(byId("segment"), run ? run.segment || "Between segments" : "No run");
    const left = run && `${duration(run.duration_s - run.elapsed_s)} left of ${duration(run.duration_s)}`;
    write(byId("time-left"), left ?? "");
  }

  /** Shows one line next to the buttons; `problem` marks an error. */
  showDetail(text, problem = false) {
    write(byId("bar-detail"), text);
    byId("bar-detail").classList.toggle("problem", problem);
  }

  /** Stops on Escape, and on Space where it has no other function; both only while something may move. */
  onKey(event) {
    const isPlain = !event.repeat && !event.ctrlKey && !event.altKey && !event.metaKey;
    if (!isPlain || !this.moving || document.querySelector("dialog[open]")) return;
    const stops = event.key === "Escape" || (event.key === " " && !event.target.closest?.(USES_SPACE));
    if (!stops) return;
    event.preventDefault();
    this.stop();
  }

  async stop() {
    this.showDetail("Stop was sent.");
    try {
      // The latest status may be old: another page may have started something since.
      if (this.stale && !this.moving) this.update(await get("agent", STOP_TIMEOUT_MS));
      if (!this.moving) return this.showDetail("Nothing to stop: no run or setup step is in progress.");
      const target = this.run ? `runs/${encodeURIComponent(this.run.id)}` : "agent";
      await post(`${target}/stop`, undefined, STOP_TIMEOUT_MS);
      if (this.state === "running") this.showDetail("Stop was accepted: the motion fades out.");
    } catch (problem) {
      this.showDetail(problem.after("Stop was not confirmed, use the emergency stop of the hardware"), true);
    }
  }

  askForReset() {
    write(byId("reset-reason"), this.status?.trip ?? "");
    byId("reset-dialog").returnValue = "";
    byId("reset-dialog").showModal();
  }

  async reset() {
    this.showDetail("Reset was sent.");
    try {
      await post("agent/reset");
      this.showDetail("");
    } catch (problem) {
      this.showDetail(problem.after("Not reset"), true);
    }
  }
}

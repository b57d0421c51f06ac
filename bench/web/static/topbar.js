// The bar that is always in sight: the bench's state, what runs, Stop, and Reset after a trip.

import { get, post } from "./api.js";
import { byId, clock, duration, fixed, write } from "./format.js";

const WORDS = {
  unknown: "No connection",
  idle: "Idle",
  preparing: "Preparing",
  running: "Running",
  stopping: "Stopping",
  tripped: "Tripped",
};
const MOVING = ["preparing", "running", "stopping"];
const STALE_S = 1.5;
const STOP_PATIENCE_MS = 3_000;
/** Where Space has a meaning of its own. Stop itself is a button, so that Space on it stops as well. */
const TAKES_SPACE = "input, select, textarea, button, a[href], summary, [contenteditable]";

export class TopBar {
  constructor({ onState }) {
    this.onState = onState;
    this.status = null;
    this.silence = "";
    this.heard = performance.now();
    this.state = null;
    byId("stop").addEventListener("click", () => this.stop());
    byId("reset").addEventListener("click", () => this.askForReset());
    byId("reset-dialog").addEventListener("close", () => byId("reset-dialog").returnValue === "reset" && this.reset());
    document.addEventListener("keydown", (event) => this.onKey(event), { capture: true });
    setInterval(() => this.show(), 100);
  }

  /** Takes a status of the agent. */
  take(status) {
    this.status = status;
    this.silence = "";
    this.heard = performance.now();
    this.show();
  }

  /** Takes what is known of why nothing is heard. */
  miss(reason) {
    this.silence = reason;
  }

  /** Age [s] of the last thing that the agent said. */
  get age() {
    return (performance.now() - this.heard) / 1000;
  }

  get stale() {
    return this.age > STALE_S;
  }

  /** The run that goes on; none while only a step before a run does. */
  get run() {
    const run = this.status?.run;
    return run && !run.outcome ? run : null;
  }

  /** True if, as far as is known, something may move. */
  get moving() {
    return MOVING.includes(this.status?.state);
  }

  show() {
    const state = this.stale || !this.status ? "unknown" : this.status.state;
    if (state !== this.state) this.enter(state);
    const word = this.status || this.stale ? WORDS[state] : "Connecting";
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
    this.say("");
    this.onState(state);
  }

  line(state) {
    const { run, trip } = this.status ?? {};
    if (state === "unknown") return this.stale ? `No data for ${fixed(this.age, 0)} s. ${this.silence}` : "";
    if (state === "tripped") return trip;
    if (state === "preparing" && !this.run) return this.status.step?.message ?? "";
    if (!run) return this.status?.step?.message ?? "Ready for a run.";
    const what = `${run.method} on ${run.specimen || "an unnamed specimen"}`;
    if (state === "idle") return `Last run: ${what}: ${[run.outcome, run.reason].filter(Boolean).join(", ")}.`;
    const by = run.operator ? ` by ${run.operator}` : "";
    return `${what}, started ${clock(new Date(run.started))}${by}`;
  }

  showProgress(state) {
    const run = MOVING.includes(state) ? this.run : null;
    const bar = byId("progress");
    bar.value = run ? Math.min(1, run.elapsed_s / run.duration_s) : 0;
    write(byId("segment"), run ? run.segment || "Between segments" : "No run");
    const left = run && `${duration(run.duration_s - run.elapsed_s)} left of ${duration(run.duration_s)}`;
    write(byId("time-left"), left ?? "");
  }

  /** One line of words beside the buttons; `problem` if something did not work. */
  say(words, problem = false) {
    write(byId("bar-detail"), words);
    byId("bar-detail").classList.toggle("problem", problem);
  }

  /** Escape stops from anywhere, Space wherever it has no other meaning; both only while something may move. */
  onKey(event) {
    const bare = !event.repeat && !event.ctrlKey && !event.altKey && !event.metaKey;
    if (!bare || !this.moving || document.querySelector("dialog[open]")) return;
    const stops = event.key === "Escape" || (event.key === " " && !event.target.closest?.(TAKES_SPACE));
    if (!stops) return;
    event.preventDefault();
    this.stop();
  }

  async stop() {
    this.say("Stop is sent.");
    try {
      // What was last heard may be old: another page may have started something since.
      if (this.stale && !this.moving) this.take(await get("agent", STOP_PATIENCE_MS));
      if (!this.moving) return this.say("Nothing runs that could be stopped.");
      const what = this.run ? `runs/${encodeURIComponent(this.run.id)}` : "agent";
      await post(`${what}/stop`, undefined, STOP_PATIENCE_MS);
      if (this.state === "running") this.say("Stop is taken: the motion fades out.");
    } catch (problem) {
      this.say(problem.after("Stop was not confirmed, use the emergency stop of the hardware"), true);
    }
  }

  askForReset() {
    write(byId("reset-reason"), this.status?.trip ?? "");
    byId("reset-dialog").returnValue = "";
    byId("reset-dialog").showModal();
  }

  async reset() {
    this.say("Reset is sent.");
    try {
      await post("agent/reset");
      this.say("");
    } catch (problem) {
      this.say(problem.after("Not reset"), true);
    }
  }
}

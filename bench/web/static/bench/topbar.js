// Bar that is always visible: state of the bench, current run, Stop, and Reset after a trip.

import { TripAlarm } from "./alarm.js";
import { get, post } from "../common/api.js";
import { benchPath } from "../common/bench.js";
import { leaveDialogs, onAnswer, openDialog } from "../common/dialogs.js";
import { byId, clock, duration, fixed, write, zone } from "../common/format.js";
import { RunControl } from "./run_control.js";

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
/**
 * Elements on which Space has another function. Stop itself is a button, so that Space on it stops as well. The
 * buttons of a dialog are not among them: while something moves, no question is as urgent as Stop.
 */
const USES_SPACE = "input, select, textarea, button:not(dialog button), a[href], summary, [contenteditable]";

export class TopBar {
  /** `clock` is the clock of the service, on which the age of a status is judged. */
  constructor({ onState, clock }) {
    this.onState = onState;
    this.clock = clock;
    this.status = null;
    this.failure = "";
    this.openedAt = performance.now();
    this.state = null;
    this.alarm = new TripAlarm();
    this.control = new RunControl({ onDetail: (...detail) => this.showDetail(...detail), run: () => this.run });
    byId("stop").addEventListener("click", () => this.stop());
    byId("reset").addEventListener("click", () => this.askForReset());
    onAnswer("reset-dialog", "reset", () => this.reset());
    document.addEventListener("keydown", (event) => this.onKey(event), { capture: true });
    setInterval(() => this.show(), 100);
  }

  /** Shows a status of the agent. */
  update(status) {
    this.status = status;
    this.failure = "";
    this.clock.update(status.utc_s);
    this.show();
  }

  /** Shows the reason why no status arrives. */
  showFailure(reason) {
    this.failure = reason;
  }

  /** Time [s] since the agent made the latest status, whenever it arrived; since the page was opened without one. */
  get age() {
    if (this.status) return this.clock.age(this.status.utc_s);
    return (performance.now() - this.openedAt) / 1000;
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
    document.title = `${word} – ${document.body.dataset.title} – mrbench`;
    write(byId("bar-line"), this.line(state));
    // Without news of the bench, its last trip still stands.
    this.alarm.show(this.status?.state === "tripped" ? this.status.trip || "no reason given" : "");
    this.control.show(state);
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
    // A run of the holder is described as any other run.
    const holder = state === "idle" && this.status?.lease?.description;
    if (holder) return `Held by ${holder}: pause or stop it to use the bench.`;
    if (!run) return this.status?.step?.message ?? "Ready for a run.";
    const description = `${run.method} on ${run.specimen || "an unnamed specimen"}`;
    if (state === "idle") return `Last run: ${description}: ${[run.outcome, run.reason].filter(Boolean).join(", ")}.`;
    const by = run.operator ? ` by ${run.operator}` : "";
    const pause = run.pause ? `. Pause: ${run.pause}` : "";
    return `${description}, started ${clock(new Date(run.started))} ${zone(new Date(run.started))}${by}${pause}`;
  }

  showProgress(state) {
    const run = MOVING.includes(state) ? this.run : null;
    const bar = byId("progress");
    bar.value = run ? Math.min(1, run.elapsed_s / run.duration_s) : 0;
    write(byId("segment"), run ? describeSegment(run) : state === "unknown" ? "Run not known" : "No run");
    const left = run && `${duration(run.duration_s - run.elapsed_s)} left of ${duration(run.duration_s)}`;
    write(byId("time-left"), left ?? "");
  }

  /** Shows one line next to the buttons; `problem` marks an error. */
  showDetail(text, problem = false) {
    write(byId("bar-detail"), text);
    byId("bar-detail").classList.toggle("problem", problem);
  }

  /**
   * Stops on Escape, and on Space where it has no other function; both only while something may move, and also while
   * a dialog is open. Otherwise Escape leaves the dialog.
   */
  onKey(event) {
    if (event.repeat || event.ctrlKey || event.altKey || event.metaKey) return;
    const escape = event.key === "Escape";
    const stops = this.moving && (escape || (event.key === " " && !event.target.closest?.(USES_SPACE)));
    if (stops) this.stop();
    if (stops || (escape && leaveDialogs())) event.preventDefault();
  }

  async stop() {
    this.showDetail("Stop was sent.");
    try {
      // The latest status may be old: another page may have started something since.
      if (this.stale && !this.moving) this.update(await get(benchPath(), STOP_TIMEOUT_MS));
      if (!this.moving) return this.showDetail("Nothing to stop: no run or setup step is in progress.");
      const target = this.run ? `runs/${encodeURIComponent(this.run.id)}` : benchPath();
      await post(`${target}/stop`, undefined, STOP_TIMEOUT_MS);
      if (this.state === "running") this.showDetail("Stop was accepted: the motion fades out.");
    } catch (problem) {
      this.showDetail(problem.after("Stop was not confirmed, use the emergency stop of the hardware"), true);
    }
  }

  askForReset() {
    write(byId("reset-reason"), this.status?.trip ?? "");
    openDialog("reset-dialog");
  }

  async reset() {
    this.showDetail("Reset was sent.");
    try {
      await post(benchPath("/reset"));
      this.showDetail("");
    } catch (problem) {
      this.showDetail(problem.after("Not reset"), true);
    }
  }
}

/** Segment and cycle of a run: `sine_10mm_1Hz, cycle 3 of 10`. */
function describeSegment({ segment, cycle, cycles }) {
  if (!segment) return "Between segments";
  return cycles ? `${segment}, cycle ${cycle} of ${cycles}` : segment;
}

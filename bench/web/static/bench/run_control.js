// Pause and Abort beside Stop. Pause ends a run at its next checkpoint, Abort stops at once by the path of a trip.

import { post } from "../common/api.js";
import { benchPath } from "../common/bench.js";
import { byId } from "../common/format.js";

const MOVING = ["preparing", "running", "stopping"];
const TIMEOUT_MS = 3_000;

export class RunControl {
  /** Takes a function that shows one line beside the buttons, and one that returns the run in progress. */
  constructor({ onDetail, run }) {
    Object.assign(this, { onDetail, run });
    byId("pause").addEventListener("click", () => this.pause());
    byId("abort").addEventListener("click", () => this.abort());
  }

  /** Shows the buttons that have a function in a state of the bench. */
  show(state) {
    const pausing = Boolean(this.run()?.pause);
    byId("pause").classList.toggle("absent", state !== "running");
    byId("pause").disabled = pausing;
    byId("abort").classList.toggle("absent", !MOVING.includes(state));
  }

  async pause() {
    const run = this.run();
    if (!run) return;
    try {
      const status = await post(`runs/${encodeURIComponent(run.id)}/pause`, undefined, TIMEOUT_MS);
      this.onDetail(status.run?.pause ?? "");
    } catch (problem) {
      this.onDetail(problem.after("Not paused"), true);
    }
  }

  async abort() {
    this.onDetail("Abort was sent.");
    try {
      await post(benchPath("/abort"), undefined, TIMEOUT_MS);
    } catch (problem) {
      this.onDetail(problem.after("Abort was not confirmed, use the emergency stop of the hardware"), true);
    }
  }
}

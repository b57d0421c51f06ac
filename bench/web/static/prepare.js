// What is done before a run: home, move, clamp, centre, tare. Homing and moving lead the rod; homing asks first.

import { post } from "./api.js";
import { byId, write } from "./format.js";

export class Preparation {
  constructor() {
    for (const button of byId("prepare").querySelectorAll("button")) {
      button.addEventListener("click", () => this.ask(button.dataset.step));
    }
    const dialog = byId("home-dialog");
    dialog.addEventListener("close", () => dialog.returnValue === "home" && this.carryOut("home"));
  }

  /** Takes a status of the agent. */
  take({ state, reference_state: reference, step }) {
    write(byId("reference-state"), reference.replaceAll("_", " ") || "unknown");
    if (step && JSON.stringify(step) !== this.shown) {
      this.shown = JSON.stringify(step);
      write(byId("prepare-note"), step.message);
    }
    for (const button of byId("prepare").querySelectorAll("button")) button.disabled = state !== "idle";
  }

  ask(step) {
    // An empty field is no place: taken for zero, it would move the rod to the middle.
    if (step === "move" && Number.isNaN(byId("move-to").valueAsNumber)) {
      return write(byId("prepare-note"), "Nothing was done: say where to move to, in mm.");
    }
    if (step !== "home") return this.carryOut(step);
    byId("home-dialog").returnValue = "";
    byId("home-dialog").showModal();
  }

  async carryOut(step) {
    try {
      const place = step === "move" ? byId("move-to").valueAsNumber / 1000 : 0;
      this.take(await post("agent/prepare", { step, position_m: place }));
    } catch (problem) {
      write(byId("prepare-note"), problem.after("Nothing was done"));
    }
  }
}

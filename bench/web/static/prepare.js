// Setup steps before a run: home, move, mount, centre, tare. Home and move move the rod; home asks first.

import { post } from "./api.js";
import { byId, write } from "./format.js";

export class SetupPanel {
  constructor() {
    for (const button of byId("prepare").querySelectorAll("button")) {
      button.addEventListener("click", () => this.ask(button.dataset.step));
    }
    const dialog = byId("home-dialog");
    dialog.addEventListener("close", () => dialog.returnValue === "home" && this.execute("home"));
  }

  /** Shows a status of the agent. */
  update({ state, reference_state: reference, step }) {
    write(byId("reference-state"), reference.replaceAll("_", " ") || "unknown");
    if (step && JSON.stringify(step) !== this.shown) {
      this.shown = JSON.stringify(step);
      write(byId("prepare-note"), step.message);
    }
    for (const button of byId("prepare").querySelectorAll("button")) button.disabled = state !== "idle";
  }

  ask(step) {
    // An empty field must not count as zero, which would move the rod to the middle.
    if (step === "move" && Number.isNaN(byId("move-to").valueAsNumber)) {
      return write(byId("prepare-note"), "Nothing was done: enter a target position in mm.");
    }
    if (step !== "home") return this.execute(step);
    byId("home-dialog").returnValue = "";
    byId("home-dialog").showModal();
  }

  async execute(step) {
    try {
      const position = step === "move" ? byId("move-to").valueAsNumber / 1000 : 0;
      this.update(await post("agent/prepare", { step, position_m: position }));
    } catch (problem) {
      write(byId("prepare-note"), problem.after("Nothing was done"));
    }
  }
}

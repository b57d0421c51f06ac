// Preparation of the bench as guided steps: tare, home, clamp, centre. Home and move move the rod; home asks first.

import { start } from "../common/api.js";
import { benchPath } from "../common/bench.js";
import { onAnswer, openDialog } from "../common/dialogs.js";
import { byId, write } from "../common/format.js";
import { QUANTITIES } from "../common/quantities.js";

/** State of the rod's reference in words. */
const REFERENCE_STATES = {
  unreferenced: "the rod's position is not known",
  homed: "position known, no specimen clamped",
  mounted: "a specimen is clamped",
  centred: "a specimen is clamped, its middle is zero",
  reference_lost: "the rod's position was lost, home it again",
};

export class Preparation {
  /** Takes a function that receives the status after a step. */
  constructor({ onStatus }) {
    this.onStatus = onStatus;
    this.reference = "";
    this.message = "";
    this.isArranged = false;
    for (const button of byId("prepare").querySelectorAll("button")) {
      button.addEventListener("click", () => this.ask(button.dataset.step));
    }
    onAnswer("home-dialog", "home", () => this.execute("home"));
  }

  /** Shows a status of the agent. */
  update({ state, reference_state: reference, step }) {
    write(byId("reference-state"), REFERENCE_STATES[reference] ?? (reference || "not known"));
    write(byId("move-unit"), QUANTITIES.displacement.unit);
    if (reference !== this.reference) this.mark(reference);
    if (step && JSON.stringify(step) !== this.shown) {
      this.shown = JSON.stringify(step);
      this.message = step.message;
      write(byId("prepare-note"), step.message);
    }
    this.enable(state === "idle");
  }

  /** Shows that nothing is known: no step counts as done, and none can be requested. Other notes stay. */
  forget() {
    write(byId("reference-state"), "not known");
    this.mark("");
    this.enable(false);
    if (byId("prepare-note").textContent !== this.message) return;
    write(byId("prepare-note"), "");
    this.shown = "";
  }

  enable(isPossible) {
    for (const button of byId("prepare").querySelectorAll("button")) button.disabled = !isPossible;
  }

  /** Marks the steps that are done, and the next one; opens the steps once if the rod's position is not known. */
  mark(reference) {
    if (reference && !this.isArranged) {
      this.isArranged = true;
      byId("preparation").open = ["unreferenced", "reference_lost"].includes(reference);
    }
    this.reference = reference;
    const steps = [...byId("prepare").querySelectorAll("li[data-done-in]")];
    const isDone = (step) => step.dataset.doneIn.split(" ").includes(reference);
    const next = reference ? steps.find((step) => !isDone(step)) : null;
    for (const step of steps) {
      step.classList.toggle("done", isDone(step));
      if (step === next) step.setAttribute("aria-current", "step");
      else step.removeAttribute("aria-current");
    }
  }

  ask(step) {
    // An empty field must not count as zero, which would move the rod to the middle.
    if (step === "move" && Number.isNaN(byId("move-to").valueAsNumber)) {
      return write(byId("prepare-note"), `Nothing was done: enter a target position in ${QUANTITIES.displacement.unit}.`);
    }
    if (step !== "home") return this.execute(step);
    openDialog("home-dialog");
  }

  async execute(step) {
    try {
      const position = step === "move" ? byId("move-to").valueAsNumber / QUANTITIES.displacement.scale : 0;
      this.onStatus(await start(benchPath("/prepare"), { step, position_m: position }));
    } catch (problem) {
      write(byId("prepare-note"), problem.after("Nothing was done"));
    }
  }
}

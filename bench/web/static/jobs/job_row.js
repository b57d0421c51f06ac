// Row of one queued or running job.

import { duration, element, fixed, write } from "../common/format.js";
import { need } from "../common/rights.js";
import { runAddress } from "../common/router.js";

export class JobRow {
  /** Takes a job, and a function that cancels it. */
  constructor({ kind, run }, cancel) {
    this.state = element("td");
    this.stage = element("span");
    this.activity = element("small");
    this.share = element("td", { className: "number" });
    this.age = element("td", { className: "number" });
    // The buttons of all rows have the same word, so their names contain kind and run.
    const button = need("analyse", element("button", { type: "button", "aria-label": `Cancel ${kind} of run ${run}` }, "Cancel"));
    button.addEventListener("click", cancel);
    this.element = element("tr", {},
      element("th", { scope: "row" }, element("a", { href: runAddress(run) }, run)),
      element("td", {}, kind), this.state, element("td", {}, this.stage, this.activity), this.share, this.age,
      element("td", { className: "actions" }, button));
  }

  /** Shows the present state of the job and its age [s] since its request. */
  show({ state, stage, activity, fraction, position }, age) {
    write(this.state, position ? `${state}, number ${position}` : state);
    write(this.stage, stage || "–");
    write(this.activity, activity);
    write(this.share, fraction === null ? "–" : `${fixed(100 * fraction, 0)} %`);
    write(this.age, duration(age));
  }
}

// Analysis of the selected runs: one job for each, and one table of their results at an address of its own.

import { start } from "../common/api.js";
import { byId, write } from "../common/format.js";
import { need } from "../common/rights.js";
import { batchAddress } from "../common/router.js";

export class BatchStart {
  /** Takes the map whose keys are the ids of the selected runs. */
  constructor(runs) {
    Object.assign(this, { runs, isRequested: false });
    this.button = need("analyse", byId("analyse-selected"));
    this.button.addEventListener("click", () => this.request());
  }

  /** Offers the analysis of one run or more. */
  show() {
    this.button.disabled = !this.runs.size || this.isRequested;
  }

  /** Requests a batch and opens its table; a refusal is shown beside the button. */
  async request() {
    this.isRequested = true;
    this.show();
    try {
      const { id } = await start("batches", { kind: byId("batch-kind").value, runs: [...this.runs.keys()] });
      location.hash = batchAddress(id);
    } catch (problem) {
      write(byId("selection-note"), problem.after("Not requested"));
    } finally {
      this.isRequested = false;
      this.show();
    }
  }
}

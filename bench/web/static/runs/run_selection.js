// Selection of runs for a comparison or an analysis. It stays while the list changes, and over searches.

import { BatchStart } from "../batches/batch_start.js";
import { compareAddress } from "../compare/compare_address.js";
import { byId, element, instant, localTime, write } from "../common/format.js";

const MOST = 20;

export class RunSelection {
  constructor() {
    this.runs = new Map(); // start of each selected run by its id, in the order of selection; empty if it is not known
    this.batch = new BatchStart(this.runs);
    byId("compare-selected").addEventListener("click", () => { location.hash = compareAddress({ runs: [...this.runs.keys()] }); });
    byId("clear-selection").addEventListener("click", () => {
      this.runs.clear();
      this.show();
      byId("runs-title").closest("section").querySelector(".scroll").focus(); // this button is disabled now
    });
    this.show();
  }

  /** Adds the runs that an address names, such as `#/runs?compare=ID`. */
  read(query) {
    for (const id of query.getAll("compare")) if (!this.runs.has(id)) this.runs.set(id, "");
    this.show();
  }

  /** Field that selects a run; only a run with a complete log can be compared or analysed. */
  box(run) {
    const label = `Select run of ${instant(run.started)}`;
    const box = element("input", { type: "checkbox", disabled: !run.log_sha256, checked: this.runs.has(run.id), "aria-label": label });
    Object.assign(box.dataset, { key: `${run.id}/select`, run: run.id });
    box.addEventListener("change", () => this.toggle(run, box.checked));
    if (this.runs.has(run.id)) this.runs.set(run.id, run.started);
    return element("label", { className: "check", title: run.log_sha256 ? label : "A comparison or an analysis needs a complete log" }, box);
  }

  toggle(run, isSelected) {
    if (isSelected) this.runs.set(run.id, run.started);
    else this.runs.delete(run.id);
    this.show();
  }

  /** Shows the number of selected runs; offers the analysis of one or more, and the comparison of two or more. */
  show() {
    const { size } = this.runs;
    byId("compare-selected").disabled = size < 2 || size > MOST;
    byId("clear-selection").disabled = !size;
    this.batch.show();
    write(byId("selection-note"), this.describe());
    for (const box of byId("runs").querySelectorAll("input[data-run]")) box.checked = this.runs.has(box.dataset.run);
  }

  describe() {
    const [[id, started] = []] = this.runs;
    const { size } = this.runs;
    if (!size) return "Select two or more runs with complete logs to compare them, or any number to analyse them.";
    const first = started ? `of ${localTime(started)}` : id;
    if (size === 1) return `1 run is selected, run ${first}. Select the runs to compare with it, or analyse it.`;
    if (size > MOST) return `${size} runs are selected; at most ${MOST} can be compared.`;
    return `${size} runs are selected; the others are compared with run ${first}.`;
  }
}

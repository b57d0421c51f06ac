// One batch at its address: a table with the result on each run, requested again until all jobs have ended.

import { isAsking } from "../account/sign_in.js";
import { refresh } from "../common/refresh.js";
import { get, saveFile } from "../common/api.js";
import { byId, element, write } from "../common/format.js";
import { describeBatch, makeBatchTable } from "./batch_table.js";

const PERIOD_MS = 2_000;
const WITHOUT_ID = "The address names no batch. Select runs in Runs, and press Analyse selected.";

export class BatchView {
  constructor() {
    Object.assign(this, { id: "", batch: null, body: element("div") });
    setInterval(() => this.follow(), PERIOD_MS);
  }

  /** Shows the batch of an address. */
  async show({ id }) {
    Object.assign(this, { id, batch: null, body: element("div") });
    byId("batch").replaceChildren(this.body);
    write(byId("batch-note"), id ? "Loading …" : WITHOUT_ID);
    if (id) await this.load();
  }

  /** Requests the present state of a batch in view that is not complete, one request at a time. */
  follow() {
    const isInView = !byId("view-batches").hidden && !document.hidden;
    if (isInView && this.batch?.unfinished && !this.isLoading && !isAsking()) this.load();
  }

  async load() {
    const { id } = this;
    this.isLoading = true;
    try {
      const batch = await get(this.path);
      if (id !== this.id) return; // another address was opened meanwhile
      this.batch = batch;
      this.render();
      write(byId("batch-note"), describeBatch(batch));
    } catch (problem) {
      if (id === this.id) write(byId("batch-note"), problem.after("The batch cannot be shown"));
    } finally {
      this.isLoading = false;
    }
  }

  get path() {
    return `batches/${encodeURIComponent(this.id)}`;
  }

  render() {
    const { batch, body } = this;
    refresh(body, [batch, byId("unit-force").value], () => [makeBatchTable(batch), this.makeSaving()]);
  }

  /** Button that saves the table for a spreadsheet, with its answer. */
  makeSaving() {
    const answer = element("small", { role: "status" });
    const button = element("button", { type: "button" }, "Save as CSV");
    button.dataset.key = "csv";
    button.addEventListener("click", async () => {
      try {
        write(answer, `${await saveFile(`${this.path}/table`, `batch-${this.id}.csv`)} was saved.`);
      } catch (problem) {
        write(answer, problem.after("Not saved"));
      }
    });
    return element("p", { className: "actions" }, button, answer);
  }

  /** Shows the forces in a changed unit. */
  relabel() {
    if (this.batch) this.render();
  }
}

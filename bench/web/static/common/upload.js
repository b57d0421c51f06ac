// Import of recordings made elsewhere: files are dropped onto any view, or chosen by a button.

import { upload } from "./api.js";
import { openDialog } from "./dialogs.js";
import { byId, element, write } from "./format.js";
import { runAddress } from "./router.js";

const isLog = ({ name }) => name.toLowerCase().endsWith(".mcap");
const hasFiles = (event) => event.dataTransfer?.types.includes("Files");

/** Groups files into requests: each log alone, all CSV files together. */
function group(files) {
  const tables = files.filter((file) => !isLog(file));
  return [...files.filter(isLog).map((file) => [file]), ...(tables.length ? [tables] : [])];
}

/** Adds to a form what holds for all CSV files: specimen, and units and senses that differ from those of a log. */
function describeTables(form) {
  const specimen = byId("upload-specimen").value.trim();
  if (specimen) form.append("specimen", specimen);
  for (const { name, value } of byId("upload-units").querySelectorAll("select, input:checked")) if (value) form.append(name, value);
}

export class UploadDialog {
  /** Takes a function that receives each new run. */
  constructor({ onRun }) {
    this.onRun = onRun;
    this.files = [];
    byId("import").addEventListener("click", () => this.open([]));
    byId("upload-files").addEventListener("change", ({ target }) => this.choose([...target.files]));
    byId("upload-form").addEventListener("submit", (event) => this.submit(event));
    byId("upload-close").addEventListener("click", () => byId("upload-dialog").close(""));
    addEventListener("dragover", (event) => hasFiles(event) && event.preventDefault());
    addEventListener("drop", (event) => this.drop(event));
  }

  drop(event) {
    if (!hasFiles(event)) return;
    event.preventDefault(); // the browser would open the file instead of this page
    this.open([...event.dataTransfer.files]);
  }

  open(files) {
    if (this.busy) return;
    openDialog("upload-dialog");
    write(byId("upload-note"), "");
    byId("upload-files").value = "";
    this.choose(files);
    byId(files.length ? "upload-specimen" : "upload-files").focus();
  }

  choose(files) {
    this.files = files;
    byId("upload-list").replaceChildren(...files.map(({ name, size }) => element("li", {}, `${name}, ${(size / 1e6).toFixed(1)} MB`)));
    byId("upload-csv").hidden = files.length > 0 && files.every(isLog);
    byId("upload-start").disabled = files.length === 0;
  }

  async submit(event) {
    event.preventDefault(); // the dialog stays open until the files are accepted
    this.setBusy(true);
    try {
      for (const files of group(this.files)) await this.send(files);
    } catch (problem) {
      write(byId("upload-note"), problem.after("Not imported"));
    } finally {
      this.setBusy(false);
    }
  }

  /** Sends the files of one run; files of accepted runs leave the list. */
  async send(files) {
    const form = new FormData();
    for (const file of files) form.append("file", file);
    if (!isLog(files[0])) describeTables(form);
    const run = await upload("logs", form, (fraction) => this.showProgress(fraction));
    this.onRun(run);
    this.choose(this.files.filter((file) => !files.includes(file)));
    if (this.files.length) return;
    byId("upload-dialog").close("done");
    location.hash = runAddress(run.id);
  }

  showProgress(fraction) {
    byId("upload-progress").value = fraction;
    write(byId("upload-note"), fraction < 1 ? `${Math.floor(100 * fraction)} % sent` : "Sent. The service reads the recording …");
  }

  setBusy(busy) {
    this.busy = busy;
    byId("upload-progress").hidden = !busy;
    byId("upload-start").disabled = busy || this.files.length === 0;
  }
}

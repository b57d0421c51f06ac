// Signatures of the reports on a run or a campaign: who has signed which file, and the report that a person reads and signs.

import { file, get, saveFile, start } from "../common/api.js";
import { element, instant, write } from "../common/format.js";
import { makeReportFrame } from "./report.js";
import { need } from "../common/rights.js";
import { signedIn } from "../common/session.js";
import { openSignDialog } from "./sign_dialog.js";
import { foldedSection, table } from "../common/tables.js";

const FILES = { intact: ["good", "as signed"], changed: ["bad", "altered after the signature"], missing: ["bad", "missing"] };
const API = "/api/v1/";

export class ReportSignatures {
  /** Takes the path of the run or campaign below the interface, and its name in a sentence. */
  constructor(path, name) {
    Object.assign(this, { path, name });
    const { section, body } = foldedSection("Signatures", { whenOpened: () => this.load() });
    this.section = section;
    this.list = element("div");
    this.answer = element("p", { className: "note", role: "status" });
    this.place = element("div", { className: "folded" });
    this.make = need("sign_reports", element("button", { type: "button" }, "Make the report to sign"));
    this.make.addEventListener("click", () => this.prepare());
    const words = "A signature belongs to one file. Read the report here and sign it then; the audit trail records its SHA-256.";
    body.append(this.list, element("p", { className: "soft" }, words), element("p", { className: "actions" }, this.make), this.answer, this.place);
  }

  async load() {
    try {
      const { items } = await get(`${this.path}/report/signatures`);
      this.list.replaceChildren(items.length ? this.makeTable(items) : element("p", { className: "soft" }, "Nobody has signed a report yet."));
    } catch (problem) {
      write(this.answer, problem.after("The signatures cannot be listed"));
    }
  }

  makeTable(items) {
    const rows = items.map((one) => [
      [one.full_name, element("small", {}, one.user)], one.meaning, instant(one.signed),
      [instant(one.made), element("small", { className: "path wrapped" }, `SHA-256 ${one.sha256}`)], describeFile(one), `entry ${one.audit_seq}`, this.makeSave(one),
    ]);
    return table("Signatures, the oldest first", ["Who", "Meaning", "Signed", "Report made", "File", "Audit trail", "Save"], rows);
  }

  makeSave({ path, full_name: person, format }) {
    const button = element("button", { type: "button", "aria-label": `Save the report that ${person} has signed` }, "Save");
    button.addEventListener("click", async () => {
      try {
        write(this.answer, `${await saveFile(path.replace(API, ""))} was saved, byte by byte as it was signed (${format}).`);
      } catch (problem) {
        write(this.answer, problem.after("Not saved"));
      }
    });
    return button;
  }

  /** Has the service make and keep the present report, and shows exactly this file. */
  async prepare() {
    if (signedIn()?.kind !== "user") return write(this.answer, "A token is of a program. A person signs: sign in with name and password.");
    write(this.answer, "The report is made, for some seconds …");
    this.place.replaceChildren();
    try {
      const copy = await start(`${this.path}/report/copies`, { format: "html" });
      const { blob } = await file(copy.path.replace(API, ""));
      this.show(copy, await blob.text());
      write(this.answer, "");
    } catch (problem) {
      write(this.answer, problem.after("There is no report to sign"));
    }
  }

  show(copy, html) {
    const sign = need("sign_reports", element("button", { type: "button", className: "primary" }, "Sign this report …"));
    const what = `Report on ${this.name}, made ${instant(copy.made)}`;
    sign.addEventListener("click", () => openSignDialog({ path: this.path, what, copy, onSigned: (made) => this.finish(made) }));
    this.place.replaceChildren(
      element("h3", { tabIndex: -1 }, "Report to be signed"), element("p", {}, `${what}.`),
      element("p", { className: "path" }, `SHA-256 ${copy.sha256}`), element("p", { className: "actions" }, sign),
      makeReportFrame(html, `Report to be signed, on ${this.name}`));
    this.place.querySelector("h3").focus();
  }

  async finish({ meaning, audit_seq: seq }) {
    this.place.replaceChildren();
    await this.load();
    write(this.answer, `Signed: ${meaning}. It is entry ${seq} of the audit trail.`);
    this.make.focus();
  }
}

/** State of the signed file, and whether its results are still the newest. */
function describeFile({ file: state, newer_results: isOld }) {
  const [kind, words] = FILES[state] ?? ["plain", state];
  const mark = element("span", { className: `mark ${kind}` }, words);
  return [mark, isOld ? element("small", { className: "attention wrapped" }, "Newer results exist; this report does not contain them.") : null].filter(Boolean);
}

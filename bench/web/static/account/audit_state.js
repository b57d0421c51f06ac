// State of the audit trail in words: its last entry, its verification on request, and its export.

import { get, post, saveFile } from "../common/api.js";
import { byId, write } from "../common/format.js";

/** Time limit of a verification [ms], which reads every entry. */
const VERIFY_TIMEOUT_MS = 300_000;

export class AuditState {
  constructor() {
    byId("audit-verify").addEventListener("submit", (event) => {
      event.preventDefault();
      this.verify();
    });
    for (const format of ["json", "csv"]) byId(`audit-export-${format}`).addEventListener("click", () => this.export(format));
  }

  /** Shows the last entry, and what the service has found wrong by itself. */
  async show() {
    const [{ seq, sha256 }, { audit }] = await Promise.all([get("audit/head"), get("health")]);
    const found = audit === "ok" ? "The service has found no fault by itself." : `The service reports: ${audit}.`;
    write(byId("audit-state"), seq ? `${seq} entries. ${found}` : `No entries yet. ${found}`);
    byId("audit-state").classList.toggle("problem", audit !== "ok");
    write(byId("audit-head"), seq ? `${seq}:${sha256}` : "–");
  }

  async verify() {
    const head = byId("audit-known").value.trim();
    this.tell("Every entry is read …");
    try {
      const found = await post("audit/verify", head ? { head } : {}, VERIFY_TIMEOUT_MS);
      this.tell(describeVerification(found, head), !found.intact);
    } catch (problem) {
      this.tell(problem.after("Not verified"), true);
    }
  }

  tell(text, isProblem = false) {
    write(byId("audit-answer"), text);
    byId("audit-answer").classList.toggle("problem", isProblem);
  }

  async export(format) {
    try {
      this.tell(`${await saveFile(`audit/export?format=${format}`)} was saved, with all entries and the last one as its head.`);
    } catch (problem) {
      this.tell(problem.after("Not exported"), true);
    }
  }
}

function describeVerification({ intact, entries, fault, imported, kept }, head) {
  const of = `${imported} of them are imported from the rig agent's own trail, and follow each other there`;
  const lines = kept ? `; ${kept} incomplete lines of killed processes are kept in entries of their own` : "";
  if (!intact) return `The trail was altered or cut. The first ${entries} entries are as written. Then: ${fault}. Compare it with an export or a backup.`;
  const end = head ? "It continues the head that you gave, so that no end is missing." : "A missing end is found only with a head that was kept.";
  return `Nothing was altered in ${entries} entries; ${of}${lines}. ${end}`;
}

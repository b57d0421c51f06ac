// View of the audit trail: conditions that stand in the address, entries from the newest on, state and export.

import { makeEntryRow } from "./audit_entries.js";
import { AuditState } from "./audit_state.js";
import { get } from "../common/api.js";
import { byId, write, zone } from "../common/format.js";

const PAGE = 50;
const TEXTS = ["actor", "action", "target", "text"];
const TIMES = ["from", "to"];

export class AuditView {
  constructor() {
    this.state = new AuditState();
    this.form = byId("audit-form");
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.search();
    });
    byId("audit-clear").addEventListener("click", () => (location.hash = "#/audit"));
    byId("audit-older").addEventListener("click", () => this.load());
  }

  /** Shows the entries that meet the conditions of the address. */
  async show({ query }) {
    this.fill(query);
    this.query = new URLSearchParams([...query].filter(([name, value]) => value && [...TEXTS, ...TIMES].includes(name)));
    this.next = null;
    byId("audit-older").hidden = byId("audit-clear").hidden = true;
    byId("audit").replaceChildren();
    write(byId("audit-zone"), `(${zone()})`);
    await this.load();
  }

  /** Lists the first entries, or adds older ones. */
  async load() {
    const { query } = this;
    const wanted = new URLSearchParams([...query, ["limit", PAGE], ...(this.next ? [["before", this.next]] : [])]);
    try {
      if (!this.next) await this.state.show();
      const { items, next } = await get(`audit?${wanted}`);
      if (query !== this.query) return; // other conditions were chosen meanwhile
      this.next = next;
      byId("audit").append(...items.map(makeEntryRow));
      byId("audit-older").hidden = next === null;
      byId("audit-clear").hidden = !query.size;
      write(byId("audit-note"), byId("audit").childElementCount ? "" : "No entry meets these conditions.");
    } catch (problem) {
      write(byId("audit-note"), problem.after("The audit trail cannot be shown"));
    }
  }

  /** Opens the address of the conditions in the form; times in it are UTC, so that it means the same elsewhere. */
  search() {
    const query = new URLSearchParams();
    for (const name of TEXTS) if (this.read(name)) query.set(name, this.read(name));
    for (const name of TIMES) if (this.read(name)) query.set(name, new Date(this.read(name)).toISOString());
    location.hash = query.size ? `#/audit?${query}` : "#/audit";
  }

  read(name) {
    return this.form.elements[name].value.trim();
  }

  fill(query) {
    for (const name of TEXTS) this.form.elements[name].value = query.get(name) ?? "";
    for (const name of TIMES) this.form.elements[name].value = toLocal(query.get(name));
  }
}

/** Time of an address as a field for local times takes it; empty for none. */
function toLocal(text) {
  const date = new Date(text ?? "");
  if (!text || Number.isNaN(date.getTime())) return "";
  return new Date(date.getTime() - 60_000 * date.getTimezoneOffset()).toISOString().slice(0, 16);
}

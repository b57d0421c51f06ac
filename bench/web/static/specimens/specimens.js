// List of the specimens: serial number, description, number of runs, last run.

import { get } from "../common/api.js";
import { byId, element, localTime, write, zone } from "../common/format.js";
import { specimenAddress } from "../common/router.js";

const PAGE = 50;

export class SpecimenList {
  constructor() {
    this.text = "";
    this.found = [];
    this.next = null;
    this.form = byId("specimens-form");
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      const text = this.form.elements.text.value.trim();
      location.hash = text ? `#/specimens?${new URLSearchParams({ text })}` : "#/specimens";
    });
    byId("more-specimens").addEventListener("click", () => this.load(this.next));
  }

  /** Lists the specimens of an address: all of them, or those with a text. */
  show({ query }) {
    this.text = query.get("text") ?? "";
    this.form.elements.text.value = this.text;
    return this.load();
  }

  /** Loads the first page, or the page after a serial number. */
  async load(before = null) {
    const { text } = this;
    const query = new URLSearchParams({ limit: PAGE, ...(text && { text }), ...(before && { before }) });
    try {
      const { items, next } = await get(`specimens?${query}`);
      if (text !== this.text) return; // another search was made meanwhile
      this.found = before ? [...this.found, ...items] : items;
      this.next = next;
      this.fill();
    } catch (problem) {
      write(byId("specimens-note"), problem.after("The specimens cannot be listed"));
    }
  }

  fill() {
    const none = this.text ? "No specimen contains this text." : "No specimens yet; a serial number is registered at its first run.";
    write(byId("specimens-note"), this.found.length ? "" : none);
    write(byId("specimens-zone"), `(${zone()})`);
    byId("specimens").replaceChildren(...this.found.map(makeRow));
    byId("more-specimens").hidden = !this.next;
  }
}

function makeRow({ serial, description, damper_kind: kind, runs, last_run: last }) {
  return element("tr", {},
    element("th", { scope: "row" }, element("a", { href: specimenAddress(serial) }, serial)),
    element("td", {}, description || "–"), element("td", {}, kind || "–"),
    element("td", { className: "number right" }, String(runs)), element("td", { className: "number" }, localTime(last)));
}

// Events of one run in their order, listed once their section is opened.

import { get } from "../common/api.js";
import { describeEvent } from "../bench/events.js";
import { element, fixed, localTime, write, zone } from "../common/format.js";
import { foldedSection, table } from "../common/tables.js";

const PAGE = 200;

export class RunEvents {
  constructor(id) {
    this.path = `runs/${encodeURIComponent(id)}/events`;
    const { section, body } = foldedSection("Events", { whenOpened: () => this.load() });
    Object.assign(this, { section, body, shown: PAGE });
    this.note = element("p", { className: "note", role: "status" });
    this.more = element("button", { type: "button" }, "Further events");
    this.more.addEventListener("click", () => this.showFurther());
  }

  /** Lists the events from the first on if the section is open; once the run has ended, they are those of its log. */
  async load() {
    if (!this.section.querySelector("details").open) return;
    try {
      const items = [];
      let next = 0;
      while (next !== null && items.length < this.shown) {
        const page = await get(`${this.path}?limit=${PAGE}&after=${next}`);
        items.push(...page.items);
        next = page.next;
      }
      this.show(items, next);
    } catch (problem) {
      write(this.note, problem.after("The events cannot be listed"));
      this.body.replaceChildren(this.note);
    }
  }

  show(items, next) {
    const rows = items.map((one) => [fixed(one.time_s, 1), localTime(one.at), element("span", { className: "wrapped" }, describeEvent(one))]);
    const heads = ["Time in the recording [s]", `When (${zone()})`, "Event"];
    write(this.note, items.length ? "" : "This run has no events.");
    this.more.hidden = next === null;
    this.body.replaceChildren(...(items.length ? [table("Events of this run", heads, rows)] : []), this.note, this.more);
  }

  async showFurther() {
    this.shown += PAGE;
    await this.load();
    if (!this.more.hidden) this.more.focus();
  }
}

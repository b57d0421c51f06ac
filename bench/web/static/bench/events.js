// List of the events of the bench: those that the service has stored, and those that have arrived since.

import { get } from "../common/api.js";
import { benchQuery } from "../common/bench.js";
import { byId, element, instant, spaced, write } from "../common/format.js";

const KEPT = 200;
const URGENT = ["trip", "alarm", "check"];

/** Kind and text of an event as an element; alarms, trips and checks are marked. */
export const describeEvent = ({ kind, text }) =>
  element("span", { className: URGENT.includes(kind) ? "attention" : "" }, `${spaced(kind)}: ${text}`);

export class EventList {
  constructor() {
    this.events = [];
  }

  /**
   * Loads the newest stored events. They replace those in view, because the end of a run stores its events again.
   * What has arrived meanwhile stays, and so does what could not be stored.
   */
  async load() {
    const before = new Set(this.events.filter(({ id }) => id !== null));
    try {
      const { items } = await get(benchQuery(`events?limit=${KEPT}`));
      const stored = new Set(items.map(({ id }) => id));
      this.events = [...this.events.filter((one) => !before.has(one) && !stored.has(one.id)), ...items];
      write(byId("events-note"), "");
    } catch (problem) {
      write(byId("events-note"), problem.after("Earlier events cannot be shown"));
    }
    this.show();
  }

  /** Adds an event that has just arrived. One without a number could not be stored. */
  add(event) {
    if (event.id !== null && this.events.some(({ id }) => id === event.id)) return;
    this.events = [event, ...this.events].slice(0, KEPT);
    this.show();
  }

  /** Shows the events, the newest first. */
  show() {
    const events = this.events.toSorted((a, b) => Date.parse(b.at) - Date.parse(a.at));
    const items = events.slice(0, KEPT).map(makeItem);
    byId("events").replaceChildren(...(items.length ? items : [element("li", { className: "soft" }, "None.")]));
  }
}

function makeItem(event) {
  const time = element("time", { className: "number", dateTime: event.at }, instant(event.at));
  return element("li", {}, time, " ", describeEvent(event));
}

// List of the events of the bench. It is kept in this tab, so that a reload loses nothing.

import { byId, clock, element, spaced, zone } from "../common/format.js";

const KEY = "mrbench.events";
const KEPT = 200;
const URGENT = ["trip", "alarm", "check"];

export class EventList {
  constructor() {
    this.events = JSON.parse(sessionStorage.getItem(KEY) ?? "[]");
    for (const event of this.events) this.append(event);
  }

  /** Adds an event that has just arrived, newest first. */
  add({ kind, text }) {
    const event = { kind, text, at: new Date().toISOString() };
    this.events = [...this.events, event].slice(-KEPT);
    sessionStorage.setItem(KEY, JSON.stringify(this.events));
    this.append(event);
  }

  append({ kind, text, at }) {
    const list = byId("events");
    if (!list.dataset.used) list.replaceChildren();
    list.dataset.used = "yes";
    const date = new Date(at);
    list.prepend(element("li", { className: URGENT.includes(kind) ? "attention" : "" },
      element("time", { className: "number", dateTime: at }, `${clock(date)} ${zone(date)}`),
      ` ${spaced(kind)}: ${text}`));
    while (list.children.length > KEPT) list.lastChild.remove();
  }
}

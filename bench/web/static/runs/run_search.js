// Search for runs: a form whose conditions stand in the address, so that a search can be kept and sent.

import { byId } from "../common/format.js";

const FIELDS = [
  "text", "specimen", "bench", "method", "outcome", "ending", "from", "to", "tag", "effect", "parameter", "parameter_min", "parameter_max",
  "trash",
];
const DAY_MS = 86_400_000;

export class RunSearch {
  constructor() {
    this.form = byId("search-form");
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.go();
    });
    byId("search-clear").addEventListener("click", () => (location.hash = "#/runs"));
  }

  /** Opens the address of the search in the form. */
  go() {
    const query = new URLSearchParams();
    for (const name of FIELDS) {
      const value = readField(this.form.elements[name]);
      if (value) query.set(name, value);
    }
    location.hash = query.size ? `#/runs?${query}` : "#/runs";
  }

  /** Fills the form from the query of an address; returns the conditions for the service. */
  read(query) {
    for (const name of FIELDS) fillField(this.form.elements[name], query.get(name) ?? "");
    const conditions = {};
    for (const name of FIELDS) if (query.get(name)) conditions[name] = query.get(name);
    if (conditions.from) conditions.from = midnight(conditions.from, 0);
    if (conditions.to) conditions.to = midnight(conditions.to, 1); // the last day counts as a whole
    const names = Object.keys(conditions);
    byId("search-clear").hidden = !names.length;
    if (names.some((name) => name !== "text")) byId("search-more").open = true;
    return conditions;
  }
}

/** Value of a field; of a checkbox its value if it is ticked, else nothing. */
const readField = (field) => (field.type === "checkbox" && !field.checked ? "" : field.value.trim());

/** Shows a value in a field; a checkbox is ticked by its own value. */
function fillField(field, value) {
  if (field.type === "checkbox") field.checked = value === field.value;
  else field.value = value;
}

/** Start of a local day, or of a later one, as UTC; another text stays, so that the service refuses it with a reason. */
function midnight(date, days) {
  const start = new Date(`${date}T00:00:00`);
  if (Number.isNaN(start.getTime())) return date;
  // By noon, because a day with a change of the clock is not 24 h long.
  const noon = new Date(start.getTime() + (days + 0.5) * DAY_MS);
  return new Date(noon.getFullYear(), noon.getMonth(), noon.getDate()).toISOString();
}

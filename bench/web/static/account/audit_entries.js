// Rows of the audit trail: who did what, when, from where, with old and new value.

import { element, localTime } from "../common/format.js";

/** Length of a value above which it is folded [characters]. */
const LONG = 60;

/** Row of one entry. */
export function makeEntryRow(entry) {
  const { seq, utc, actor, origin, action, target, old, new: value, outcome } = entry;
  return element("tr", {},
    element("th", { scope: "row", className: "number" }, `${seq}`),
    element("td", { className: "number" }, localTime(utc)),
    element("td", {}, actor, element("small", {}, origin ? `from ${origin}` : "")),
    element("td", {}, action, element("small", {}, target), ...describeSource(entry)),
    element("td", {}, showValue(old, `Old value of entry ${seq}`)),
    element("td", {}, showValue(value, `New value of entry ${seq}`)),
    element("td", {}, outcome));
}

/** Place of an imported entry in the trail of the rig agent, and the sender that the agent itself has seen. */
function describeSource({ source, peer }) {
  if (!source) return [];
  return [element("small", {}, `entry ${source.seq} of the rig agent's own trail${peer ? `, sent by ${peer}` : ""}`)];
}

/** Value of an entry; a long one is folded, so that the table stays readable. */
function showValue(value, label) {
  if (value === null) return element("span", { className: "soft" }, "–");
  const text = typeof value === "string" ? value : JSON.stringify(value, null, 1);
  const shown = element("code", { className: "path value-text" }, text);
  if (text.length <= LONG) return shown;
  const names = typeof value === "object" ? Object.keys(value).slice(0, 3).join(", ") : `${text.slice(0, LONG)} …`;
  return element("details", {}, element("summary", { "aria-label": `${label}: ${names}` }, names), shown);
}

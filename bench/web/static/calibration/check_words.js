// Checks in words, in the units that the person has chosen.

import { duration, significant, spaced } from "../common/format.js";
import { QUANTITIES } from "../common/quantities.js";

const DAY_S = 86_400;

/** Name of a series in addresses: that of its channel, with the kind of check unless it is a zero check. */
export const keyOf = ({ channel, check }) => (check === "zero" ? channel : `${channel}.${check}`);

/** Name of a series in words. */
export const nameOf = ({ channel, check }) => (check === "zero" ? spaced(channel) : `${spaced(channel)} with the ${check}`);

/** Displayed quantity of a channel, with its unit. */
export const quantityOf = (channel) => Object.values(QUANTITIES).find(({ field }) => field === channel);

/** Value of a channel with its unit; the value is in SI. */
export function withUnit(value, channel, digits = 3) {
  const { scale, unit } = quantityOf(channel);
  return `${significant(value * scale, digits)}\u00a0${unit}`;
}

/** Value of a series with its unit; the limits of a shunt check differ from its centre by a thousandth. */
export const valueOf = (value, { channel, check }) => withUnit(value, channel, check === "zero" ? 3 : 6);

/** Age of an instant: `42 s ago`, `3 days ago`. */
export function age(text) {
  const seconds = (Date.now() - new Date(text)) / 1e3;
  return `${seconds < 2 * DAY_S ? duration(seconds) : `${Math.floor(seconds / DAY_S)} days`} ago`;
}

/** State of the latest check of a chart: mark, and the reason in words. */
export function describeState({ state, series, points, limits, count, needed }) {
  const latest = points.at(-1);
  switch (state) {
    case "in_control":
      return { kind: "good", word: "in control", reason: `all rules kept${describeBaseline(points)}` };
    case "out_of_control":
      return { kind: "bad", word: "out of control", reason: latest.rules.map((rule) => RULES[rule](latest, limits, series)).join("; ") };
    case "no_limits":
      return { kind: "plain", word: "no limits", reason: "all checks of the baseline have the same value" };
    default:
      return { kind: "plain", word: "not enough checks", reason: `${count} of ${needed}` };
  }
}

const RULES = {
  beyond_limits: ({ value }, { lower, upper }, series) => describeBeyond("", value, lower, upper, series),
  drift: ({ ewma }, limits, series) => describeBeyond("the weighted mean ", ewma, limits.ewma_lower, limits.ewma_upper, series),
  run_of_eight: ({ value }, { centre }, series) =>
    `8 checks in a row are ${value > centre ? "above" : "below"} the centre ${valueOf(centre, series)}`,
};

function describeBeyond(what, value, lower, upper, series) {
  const [word, limit] = value > upper ? ["above", upper] : ["below", lower];
  return `${what}${valueOf(value, series)} is ${word} the limit ${valueOf(limit, series)}`;
}

function describeBaseline(points) {
  const beyond = points.filter(({ is_baseline: isBaseline, rules }) => isBaseline && rules.length).length;
  return beyond ? `; ${beyond} of the baseline beyond the limits: find the cause, or begin a new baseline` : "";
}

/** Names of the rules by which a check is out of control. */
export const listRules = ({ rules }) => rules.map((rule) => spaced(rule)).join(", ");

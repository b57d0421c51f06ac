// Conditions in which the gap appears, and what remains of it with the named effects: a table, and a figure over the stroke.

import { CurvePlot } from "../common/curve_plot.js";
import { describeCondition, inForceUnit } from "./fit_tables.js";
import { QUANTITIES } from "../common/quantities.js";
import { table } from "../common/tables.js";

/** Groups the entries of a map by their condition; the one with the largest gap first. */
function groupByCondition(map) {
  const groups = new Map();
  for (const entry of map) {
    const key = conditionKey(entry);
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push(entry);
  }
  return [...groups.entries()].sort(([, a], [, b]) => rootMeanSquare(b) - rootMeanSquare(a));
}

const conditionKey = ({ drive, amplitude_m: amplitude, frequency_hz: frequency }) => [drive, amplitude, frequency].map((value) => value.toPrecision(3)).join("/");

const rootMeanSquare = (entries) => Math.sqrt(entries.reduce((sum, { gap_n: gap }) => sum + gap * gap, 0) / entries.length);

const describe = ([entry], driveUnit) => describeCondition({ ...entry, drive_value: entry.drive }, driveUnit);

/** Gap beyond the noise in each condition, without effects and with the named ones. */
export function makeGapTable({ where, remainder, effects }, driveUnit) {
  const left = new Map(groupByCondition(remainder?.map ?? []));
  const { unit } = QUANTITIES.force;
  const isNamed = effects.length > 0;
  const rows = groupByCondition(where.map).map(([key, entries]) => [
    ...describe(entries, driveUnit), inForceUnit(rootMeanSquare(entries)),
    ...(isNamed ? [left.has(key) ? inForceUnit(rootMeanSquare(left.get(key))) : "none"] : []),
  ]);
  const heads = ["Amplitude", "Frequency", "Drive", `Without effects [${unit}]`];
  return table("Where the gap appears: force error beyond the noise", isNamed ? [...heads, `Remains with effects [${unit}]`] : heads, rows);
}

/** Figure of the gap over one stroke, in the condition with the largest gap; null where no motion is periodic. */
export function gapOverStroke({ where, remainder }, driveUnit) {
  const [worst] = groupByCondition(where.map.filter(({ frequency_hz: frequency }) => frequency > 0));
  if (!worst || worst[1].length < 2) return null;
  const [key, entries] = worst;
  const left = (remainder?.map ?? []).filter((entry) => conditionKey(entry) === key);
  const curve = (name, colour, points, dashed) => {
    const sorted = points.toSorted((a, b) => a.phase - b.phase);
    return { name, colour, dashed, x: sorted.map(({ phase }) => phase), y: sorted.map(({ gap_n: gap }) => gap * QUANTITIES.force.scale) };
  };
  return new CurvePlot({
    title: `Gap over the stroke at ${describe(entries, driveUnit).join(", ")}.`,
    across: "phase [cycles]; 0: middle in extension, 0.25: extended end", up: `gap beyond the noise [${QUANTITIES.force.unit}]`,
    curves: [curve("without effects", "--bad", entries, false), ...(left.length > 1 ? [curve("remains with effects", "--good", left, true)] : [])],
  });
}

// Conditions in which the runs of a comparison differ, in words with the units of the person.

import { element, fixed } from "../common/format.js";
import { QUANTITIES } from "../common/quantities.js";
import { describeRun, letter } from "./run_styles.js";

/** Conditions whose numbers are shown in chosen units; the others are shown as the service words them. */
const CONVERTED = { stroke: QUANTITIES.displacement, preload: QUANTITIES.force };
const LIMITS = "temperature within 2 K; stroke, rate and drive within 2 %; preload within 2 % of the peak force";

/** Warnings with the largest difference of each condition and run, all differences, and the limits of the comparison. */
export function makeConditions({ runs, differences, strokes, notes }) {
  const groups = Map.groupBy(differences, ({ run, quantity }) => `${run} ${quantity}`);
  const warnings = [...groups.values()].map((group) => element("li", {}, describeGroup(runs, group)));
  const lead = warnings.length
    ? `The runs differ in these conditions from run ${letter(0)}. A force that differs is then not yet a changed damper.`
    : strokes.length ? `No condition differs from run ${letter(0)}: ${LIMITS}.` : "";
  const made = [element("p", {}, lead)];
  if (warnings.length) made.push(element("ul", { className: "warnings", "aria-label": "Conditions that differ" }, ...warnings));
  if (differences.length > warnings.length) made.push(makeAll(runs, differences));
  const limits = [...notes, ...listUnmeasured(runs, strokes)].map((text) => element("p", { className: "attention" }, text));
  return [...made, ...limits];
}

/** Words for the largest difference of a group: `B: MR-0042, quick, 2025-03-04 10:12:30: temperature: 21 °C against 24.5 °C`. */
function describeGroup(runs, group) {
  const [largest] = group.toSorted((a, b) => distance(b) - distance(a));
  const place = findPlace(runs, largest.run);
  const where = largest.segment && ` in ${largest.segment}`;
  const count = group.length > 1 ? `, the largest of ${group.length} strokes` : "";
  return `${describeRun(runs[place], place)}. ${describe(largest)} (${letter(0)} against ${letter(place)})${where}${count}`;
}

const distance = ({ first, other }) => Math.abs((other ?? 0) - (first ?? 0));
const findPlace = (runs, id) => runs.findIndex(({ run }) => run === id);

function describe({ quantity, first, other, text }) {
  const shown = CONVERTED[quantity];
  if (!shown) return text.replace(/^./, (letters) => letters.toUpperCase());
  const [one, two] = [first, other].map((value) => `${fixed(value * shown.scale, shown.digits)} ${shown.unit}`);
  return `${quantity.replace(/^./, (letters) => letters.toUpperCase())}: ${one} against ${two}`;
}

function makeAll(runs, differences) {
  const word = (one) => `Run ${letter(findPlace(runs, one.run))}, ${one.segment || "whole run"}: ${describe(one)}`;
  const lines = differences.map((one) => element("li", {}, word(one)));
  return element("details", {}, element("summary", {}, `All ${differences.length} differences`), element("ul", {}, ...lines));
}

/** Names the runs whose temperature is not known: it was then not compared. */
function listUnmeasured(runs, strokes) {
  const unmeasured = strokes.flatMap((stroke) => stroke.strokes).filter((one) => one.temperature_c === null);
  const names = runs.flatMap(({ run }, place) => (unmeasured.some((one) => one.run === run) ? [letter(place)] : []));
  return names.length ? [`The temperature was not measured in run ${names.join(", ")}, so it is not compared there.`] : [];
}

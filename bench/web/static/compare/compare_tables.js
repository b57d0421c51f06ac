// Tables of a comparison: verdicts, peak forces, energies and parameters, with a column for each run.

import { describeDrive } from "./compare_curves.js";
import { element, fixed, significant, spaced } from "../common/format.js";
import { QUANTITIES } from "../common/quantities.js";
import { table } from "../common/tables.js";
import { letter } from "./run_styles.js";

const RESULTS = { pass: "good", fail: "bad" };

/** Conditions of a stroke of the first run: amplitude, frequency and drive with units. */
export function describeStroke({ strokes: [first] }, unit) {
  const { displacement } = QUANTITIES;
  const amplitude = fixed(first.amplitude_m * displacement.scale, displacement.digits);
  return `± ${amplitude} ${displacement.unit}, ${significant(first.frequency_hz, 3)} Hz, ${describeDrive(first.drive, unit)}`;
}

/** Words for the band of the reference: its parts, and the condition for a pass. */
export function describeBand({ runs, reference, strokes, verdicts }, tolerance) {
  if (!reference) return "Choose a reference run above, to test the other runs against its tolerance band.";
  const name = `run ${letter(runs.findIndex(({ run }) => run === reference))}`;
  if (!verdicts.length) return `No other run has a stroke of ${name}, so that nothing is tested.`;
  const known = strokes.some(({ band }) => band?.model_uncertainty_n !== null && band);
  const model = known ? " and by half of the 95 % band of its fit" : "; it has no fit whose band could be added";
  return `The band reaches from the mean force of ${name} by ${tolerance} % of its peak force${model}. `
    + "A run passes if at least 95 % of the phases of a stroke are inside.";
}

/** Verdicts on all runs at each drive of the reference. */
export function makeDriveVerdicts({ runs, reference, verdicts, drive_unit: unit }) {
  const drives = [...new Set(verdicts.map(({ drive }) => drive))].sort((a, b) => a - b);
  return table("Result at each drive", ["Drive", ...heads(runs, reference)], drives.map((drive) =>
    [[describeDrive(drive, unit)], ...others(runs, reference).map(({ run }) => {
      const found = verdicts.find((one) => one.run === run && one.drive === drive);
      return found ? [mark(found.result), small(`${found.strokes} ${found.strokes === 1 ? "stroke" : "strokes"}`)] : ["–"];
    })]));
}

/** Verdicts on all runs for each stroke, with the share of the phases inside and the margin to the edge of the band. */
export function makeStrokeVerdicts(comparison) {
  const { runs, reference, strokes } = comparison;
  const { force } = QUANTITIES;
  const caption = `Result of each stroke; margin: smallest distance to the edge of the band [${force.unit}], negative outside`;
  return table(caption, ["Stroke", ...heads(runs, reference)], strokes.map((stroke, k) =>
    [nameStroke(comparison, k), ...others(runs, reference).map(({ run }) => {
      const found = stroke.band?.tests.find((one) => one.run === run);
      if (!found) return ["–"];
      const margin = `margin ${fixed(found.margin_n * force.scale, force.digits)} ${force.unit}`;
      return [mark(found.result), small(`${margin}, ${significant(100 * found.inside, 3)} % inside`)];
    })]));
}

/** Peak forces of all strokes with largest speed and temperature. */
export function makePeakTable(comparison) {
  const { force, velocity } = QUANTITIES;
  const caption = `Peak force in tension / compression [${force.unit}], below it the largest speed and the temperature`;
  return strokeTable(comparison, caption, (one) => {
    const peaks = [one.peak_tension_n, one.peak_compression_n].map((peak) => fixed(peak * force.scale, force.digits));
    const speed = `${fixed(one.peak_velocity_mps * velocity.scale, velocity.digits)} ${velocity.unit}`;
    const temperature = one.temperature_c === null ? "no temperature" : `${fixed(one.temperature_c, 1)} °C`;
    return [peaks.join(" / "), small(`${speed}, ${temperature}`)];
  });
}

/** Energies of all strokes, with the change against the first run. */
export function makeEnergyTable(comparison) {
  const caption = "Dissipated energy per cycle [J], mean ± standard deviation from cycle to cycle";
  return strokeTable(comparison, caption, (one, first) => {
    const change = 100 * (one.energy_j / first.energy_j - 1);
    const against = one === first ? "" : `, ${change > 0 ? "+" : ""}${fixed(change, 1)} % against ${letter(0)}`;
    const cycles = `${one.cycles} ${one.cycles === 1 ? "cycle" : "cycles"}`;
    return [`${significant(one.energy_j, 4)} ± ${significant(one.energy_sd_j, 2)}`, small(`${cycles}${against}`)];
  });
}

/** Identified parameters of all runs with a fit, in SI units. */
export function makeParameterDifferences({ runs, parameters }) {
  const isFitted = ({ run }) => parameters.some(({ values }) => run in values);
  const fitted = runs.map((run, place) => ({ ...run, head: `Run ${letter(place)}` })).filter(isFitted);
  const rows = parameters.map((one) => [
    [spaced(one.name)], [one.unit === "1" ? "–" : one.unit], ...fitted.map(({ run }) => describeValue(one, run)),
    [element("span", { className: `mark ${one.differs ? "fair" : "good"}` }, one.differs ? "differs" : "agrees")],
  ]);
  return table("Identified parameters with 95 % intervals", ["Parameter", "Unit", ...fitted.map(({ head }) => head), "Comparison"], rows);
}

/** Table with a row for each stroke and a cell for each run; `fill` receives the stroke of the run and of the first one. */
function strokeTable(comparison, caption, fill) {
  const { runs, strokes } = comparison;
  return table(caption, ["Stroke", ...runs.map((run, place) => `Run ${letter(place)}`)], strokes.map((stroke, k) =>
    [nameStroke(comparison, k), ...runs.map(({ run }) => {
      const found = stroke.strokes.find((one) => one.run === run);
      return found ? fill(found, stroke.strokes[0]) : ["–"];
    })]));
}

const nameStroke = ({ strokes, drive_unit: unit }, k) => [`${k + 1}. ${strokes[k].name}`, small(describeStroke(strokes[k], unit))];
const describeValue = ({ values, ci95 }, run) =>
  (run in values ? [significant(values[run]), small(ci95[run].map((edge) => significant(edge)).join(" … "))] : ["–"]);
const others = (runs, reference) => runs.filter(({ run }) => run !== reference);
const heads = (runs, reference) => others(runs, reference).map((run) => `Run ${letter(runs.indexOf(run))}`);
const mark = (result) => element("span", { className: `mark ${RESULTS[result]}` }, result);
const small = (text) => element("small", {}, text);

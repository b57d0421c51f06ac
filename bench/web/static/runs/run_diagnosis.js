// Diagnosis of a run in words and pictures: what the simulation lacks, where, how sure, and what remains.

import { clearPlots } from "../common/axes_plot.js";
import { CurvePlot } from "../common/curve_plot.js";
import { forceText, inForceUnit, percent, shareInterval } from "./fit_tables.js";
import { element, significant, spaced, suitUnit } from "../common/format.js";
import { gapOverStroke, makeGapTable } from "./gap_map.js";
import { QUANTITIES } from "../common/quantities.js";
import { factList, table } from "../common/tables.js";

const VERDICTS = {
  no_gap: "The simulation reproduces the recording: no effect is missing.",
  explained: "The simulation lacks effects, which the diagnosis names.",
  partly_explained: "The simulation lacks effects, and the diagnosis names some of them.",
  unexplained: "The simulation lacks an effect that no known effect explains.",
};
/** Stages in the order of the signal. */
const STAGES = ["coil", "damper", "mounting", "force_channel", "displacement_channel"];
/** Quantity that the value of an effect is, by its place. */
const PLACE_QUANTITIES = {
  drive: "added drive", field: "added field", damper_gain: "relative change of alpha, c0 and c1", parallel_force: "added force",
  mounting: "added force", force_channel: "added force", displacement_channel: "added displacement",
};
const VARIABLE_UNITS = {
  displacement: "m", velocity: "m/s", acceleration: "m/s²", travel_since_reversal: "m", travel_since_rest: "m", force: "N",
  drive: "{drive}", drive_history: "{drive}", temperature: "K", time: "s", dissipated_energy: "J",
};

/** Names of a set of effects in words. */
export const joinEffects = (names) => names.map(spaced).join(" and ") || "the law alone";

export class DiagnosisPart {
  /** Takes the place that it fills, the diagnosis and the unit of the drive, V or A. */
  constructor(place, diagnosis, driveUnit) {
    Object.assign(this, { place, diagnosis, driveUnit, plots: [] });
  }

  /** Shows the diagnosis in the chosen units. */
  show() {
    clearPlots(this.plots);
    const { diagnosis: found } = this;
    this.plots.push(...this.makePlots());
    const map = found.verdict === "no_gap" ? [] : [makeGapTable(found, this.driveUnit)];
    this.place.replaceChildren(
      element("p", {}, element("strong", {}, VERDICTS[found.verdict] ?? spaced(found.verdict))), element("p", {}, found.explanation),
      ...(found.effects.length ? [effectTable(found.effects)] : []),
      element("div", { className: "figures" }, errorBars(found.gap, found.effects.length), stageBars(found.where), ...this.plots.map(({ figure }) => figure)),
      factList({ ...describeGap(found), ...describeRemainder(found.remainder), ...describeDiscovery(found.discovery) }), ...map,
      ...found.notes.map((text) => element("p", { className: "soft" }, text)));
    for (const plot of this.plots) plot.draw();
  }

  makePlots() {
    const { diagnosis: found, driveUnit } = this;
    const gap = found.verdict === "no_gap" ? null : gapOverStroke(found, driveUnit);
    const curves = found.discovery ? [found.discovery, ...found.discovery.further] : [];
    return [...(gap ? [gap] : []), ...curves.map((one) => effectCurve(one, driveUnit))];
  }

  destroy() {
    clearPlots(this.plots);
  }
}

function effectTable(effects) {
  const isNoted = effects.some(({ note }) => note);
  const rows = effects.map((one) => [
    spaced(one.name), spaced(one.stage) + (one.place && one.place !== one.stage ? `, ${spaced(one.place)}` : ""), percent(one.probability),
    percent(one.share) + (one.share_ci95 ? ` (${percent(one.share_ci95[0])} … ${percent(one.share_ci95[1])})` : ""),
    lines(Object.entries(one.parameters).map(([name, value]) => `${spaced(name)} ${interval(value)}`)),
    ...(isNoted ? [element("span", { className: "wrapped" }, one.note)] : []),
  ]);
  const heads = ["Effect", "Place in the chain", "Probability", "Share of the gap (95 % interval)", "Size (95 % interval)"];
  return table("Effects that the simulation lacks", isNoted ? [...heads, "Note"] : heads, rows);
}

const lines = (texts) => element("span", {}, ...texts.map((text) => element("span", { className: "line" }, text)));

/** A value with its unit and its interval; symbols of a formula stay in SI. */
function interval({ value, unit, ci95: [low, high] }, [shown, factor] = suitUnit(unit, value)) {
  const [at, from, to] = [value, low, high].map((one) => significant(one * factor, 3));
  return `${at}${shown === "1" ? "" : ` ${raised(shown)}`} (${from} … ${to})`;
}

/** Bars of the force error on strokes that no fit has read: without the effects, with them, and the noise. */
function errorBars(gap, isNamed) {
  const rows = [["Law refitted, without effects", gap.before_n]];
  if (isNamed) rows.push(["With the named effects", gap.after_n]);
  if (gap.nominal_n !== null) rows.unshift(["Simulation as given", gap.nominal_n]);
  const largest = Math.max(...rows.map(([, value]) => value), gap.noise_floor_n);
  const bars = [...rows, ["Noise floor of the force", gap.noise_floor_n]];
  return barFigure("Force error on strokes that no fit has read.", `RMSE [${QUANTITIES.force.unit}]`,
    bars.map(([name, value]) => ({ name, share: value / largest, text: forceText(value) })));
}

/** Bars of the probability that an effect is missing in a stage, in the order of the signal. */
function stageBars({ stages }) {
  return barFigure("Where in the chain an effect is missing.", "probability [%]", STAGES.filter((name) => name in stages)
    .map((name) => ({ name: spaced(name), share: stages[name], text: percent(stages[name]) })));
}

function barFigure(title, unit, bars) {
  const rows = bars.map(({ name, share, text }) => {
    const bar = element("span", { className: "bar-share", "aria-hidden": "true" });
    bar.style.width = `${100 * Math.min(1, Math.max(0, share))}%`;
    return element("div", {}, element("dt", {}, name), element("dd", {}, element("span", { className: "bar-track" }, bar), element("span", { className: "number" }, text)));
  });
  return element("figure", { className: "bars" }, element("figcaption", {}, element("strong", {}, title), ` ${unit}`), element("dl", {}, ...rows));
}

function describeGap({ gap, effects, probability, alternatives, unknown_probability: unknown, verdict }) {
  const named = verdict === "unexplained" ? [] : [`${joinEffects(effects.map(({ name }) => name))}: ${percent(probability)}`];
  const sets = [...named, ...alternatives.map((one) => `${joinEffects(one.effects)}: ${percent(one.probability)}`), `an effect outside the library: ${percent(unknown)}`];
  const shrinkage = gap.shrinkage === null
    ? "not defined, because the error is within 2 % of the noise floor" : `${percent(gap.shrinkage)}${shareInterval(gap.shrinkage_ci95)}`;
  const floor = gap.noise_floor_ci95 ? ` (95 % interval ${inForceUnit(gap.noise_floor_ci95[0])} to ${forceText(gap.noise_floor_ci95[1])})` : "";
  return {
    ...(effects.length && { "Gap closed on unseen strokes": [shrinkage] }),
    "Noise floor": [forceText(gap.noise_floor_n) + floor, gap.floor_known === false ? element("small", {}, "Only bounded, because no cycles show it.") : null],
    "Probability of each set of effects": sets.map((text) => element("span", { className: "line" }, text)),
  };
}

function describeRemainder(remainder) {
  if (!remainder) return { Remains: ["nothing beyond the noise"] };
  const where = remainder.stage ? `, most probably in the ${spaced(remainder.stage)}` : "";
  const over = remainder.variables.length ? `It depends on ${remainder.variables.map(spaced).join(", ")}.` : null;
  const cycles = remainder.not_repeating === null ? "" : ` ${percent(remainder.not_repeating)} of it differ from cycle to cycle.`;
  return {
    Remains: [`${forceText(remainder.gap_n)} beyond the noise${where}.`,
      element("small", {}, `${percent(remainder.explainable)} of it follow stroke and drive.${cycles}`), over && element("small", {}, over)],
  };
}

function describeDiscovery(discovery) {
  if (!discovery) return {};
  const { place, variables, formula, shrinkage, shrinkage_ci95: range } = discovery;
  const symbols = Object.entries(formula?.symbols ?? {}).map(([name, value]) => `${name} = ${interval(value, [value.unit, 1])}`);
  return {
    "Outside the library": [`${isStepResponse(discovery) ? "step response of the " : ""}${spaced(place)} over ${variables.map(spaced).join(" and ")}`, formula && element("small", { className: "path" }, formula.expression),
      ...symbols.map((text) => element("small", {}, text)), shrinkage === null ? null : element("small", {}, `Gap closed with it: ${percent(shrinkage)}${shareInterval(range)}.`)],
  };
}

/** Whether the curve of an effect is the part of a change that has arrived, over the time since it. */
const isStepResponse = ({ variables, curve }) => !variables.includes(curve.variable);

/** Curve of an effect outside the library with its 95 % band, in the chosen units of force and length. */
function effectCurve({ place, variables, curve }, driveUnit) {
  const x = inUnit(VARIABLE_UNITS[curve.variable] ?? "", driveUnit);
  const y = inUnit(curve.unit, driveUnit);
  const isResponse = isStepResponse({ variables, curve });
  const isAdded = ["drive", "field"].includes(place) && !isResponse;
  const isRelative = isAdded && curve.unit !== "{drive}" && curve.unit !== driveUnit;
  const elongation = place === "mounting" && curve.variable === "force" ? "elongation of the mounting" : null;
  const lead = place === "displacement_channel" && variables.slice(1).includes("velocity") ? "lead of the displacement" : null;
  const quantity = isResponse ? "step response" : elongation ?? lead ?? PLACE_QUANTITIES[place] ?? spaced(place);
  const up = `${quantity}${isRelative ? " over drive" : ""}${y.unit === "1" ? "" : ` [${y.unit}]`}`;
  const across = curve.x.map((value) => value * x.scale);
  const convert = (values) => values.map((value) => value * y.scale);
  const band = curve.lo && curve.hi && { name: "95 % band", colour: "--force", x: across, low: convert(curve.lo), high: convert(curve.hi) };
  return new CurvePlot({
    title: `Effect at the ${spaced(place)}.`, across: `${isResponse ? "time since a change" : spaced(curve.variable)} [${x.unit}]`, up,
    curves: [{ name: "found effect", colour: "--force", x: across, y: convert(curve.value) }], band,
  });
}

/** Scale and name of the unit in which a person reads an SI unit. */
function inUnit(unit, driveUnit) {
  const chosen = { N: QUANTITIES.force, m: QUANTITIES.displacement, "m/s": QUANTITIES.velocity }[unit];
  return chosen ?? { scale: 1, unit: raised(unit.replace("{drive}", driveUnit)) };
}

/** Unit with squares and cubes as a person writes them. */
const raised = (unit) => unit.replaceAll("^2", "²").replaceAll("^3", "³");

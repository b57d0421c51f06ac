// Trend of a specimen: a chosen quantity over its runs, its drift and outliers, and the cause in words.

import { findOutliers, fitLine } from "./drift.js";
import { element, instant, localTime, significant, spaced, zone } from "../common/format.js";
import { runAddress } from "../common/router.js";
import { table } from "../common/tables.js";
import { TrendPlot } from "./trend_plot.js";
import { describeQuantity, listSeries, placePoints, readChanges } from "./trend_series.js";

const GROUPS = { trend: "Trend: effects and law, fitted to all runs alike", fit: "Parameters of the fit of each run" };

export class SpecimenTrend {
  /** Takes the element above the figure, and a function that receives each choice `{ quantity, over }`. */
  constructor(request, onChoice) {
    this.onChoice = onChoice;
    this.plot = null;
    this.words = element("div", { className: "words" });
    this.quantity = element("select", { name: "quantity" });
    this.over = element("select", { name: "over" },
      element("option", { value: "number" }, "number of the run"), element("option", { value: "time" }, "time"));
    for (const field of [this.quantity, this.over]) field.addEventListener("change", () => this.choose());
    this.choice = element("div", { className: "fields" },
      element("label", {}, element("span", {}, "Quantity"), this.quantity), element("label", {}, element("span", {}, "Over"), this.over));
    this.figure = element("figure");
    this.drift = element("div", { role: "status" });
    this.values = element("div");
    this.place = element("section", { "aria-label": "Trend" }, element("h2", {}, "Trend over the runs"),
      request, this.words, this.choice, this.figure, this.drift, this.values);
  }

  /** Shows trend and parameters of the fits; `trend` is null where there is none yet. */
  show({ trend, parameters, runs, choice }) {
    this.series = listSeries(trend, parameters, runs);
    this.changes = trend ? readChanges(trend) : [];
    this.words.replaceChildren(...(trend ? describeTrend(trend, this.changes) : []));
    this.fillChoice(choice);
    this.draw();
  }

  fillChoice({ quantity, over }) {
    const groups = Object.entries(GROUPS).map(([source, label]) => {
      const own = this.series.filter((one) => one.source === source);
      const options = own.map(({ key, unit }) => element("option", { value: key }, `${describeQuantity(key.replace("fit.", ""))}${inUnit(unit)}`));
      return options.length ? element("optgroup", { label }, ...options) : null;
    });
    this.quantity.replaceChildren(...groups.filter(Boolean));
    const strongest = this.changes.filter(({ direction }) => direction !== "steady")
      .sort((a, b) => b.quantity.includes(".") - a.quantity.includes(".") || b.deviations - a.deviations)[0];
    const wanted = [quantity, strongest?.quantity, this.series[0]?.key];
    this.quantity.value = wanted.find((key) => this.series.some((one) => one.key === key)) ?? "";
    this.over.value = over === "time" ? "time" : "number";
    this.choice.hidden = !this.series.length;
  }

  choose() {
    this.onChoice({ quantity: this.quantity.value, over: this.over.value });
    this.draw();
  }

  draw() {
    this.destroy();
    const series = this.series.find(({ key }) => key === this.quantity.value);
    if (!series) {
      this.figure.replaceChildren();
      this.values.replaceChildren();
      this.drift.replaceChildren(element("p", { className: "soft" },
        "Identify the runs of this specimen to see the parameters of their fits, or compute the trend."));
      return;
    }
    const over = this.over.value;
    const { placed, change } = placePoints(series, over);
    const line = fitLine(placed, change);
    const outliers = findOutliers(placed, change).map((k) => placed[k]);
    const facts = { series, placed, line, outliers, isTime: over === "time", change };
    this.drift.replaceChildren(...describeDrift(facts, this.changes.find((one) => one.quantity === series.key)));
    this.values.replaceChildren(makeValueTable(facts));
    this.plot = drawFigure(this.figure, facts);
  }

  destroy() {
    this.plot?.destroy();
    this.plot = null;
  }
}

const inUnit = (unit) => (unit === "1" ? "" : ` [${unit}]`);
const withUnit = (value, unit) => `${significant(value)}${unit === "1" ? "" : `\u00a0${unit}`}`;
const nameOf = ({ key }) => describeQuantity(key.replace("fit.", ""));

/** Cause in the words of the document, and a table of all its quantities. */
function describeTrend(trend, changes) {
  const number = (log) => trend.runs.findIndex((run) => run.log === log) + 1;
  const rows = changes.map(({ quantity, unit, direction, since, change_per_run: slope, deviations, values }) => [
    describeQuantity(quantity), direction, since ? `run ${number(since)}` : "–",
    since ? `${withUnit(slope, unit)} per run` : "–", significant(deviations, 2),
    `${withUnit(values[0].value, unit)} … ${withUnit(values.at(-1).value, unit)}`,
  ]);
  const effects = trend.effects.map((name) => spaced(name)).join(", ") || "none";
  const heads = ["Quantity", "Direction", "Since", "Change", "Change / standard deviation", "First … last value"];
  return [
    element("h3", {}, "Cause"), element("p", { className: "cause" }, trend.explanation),
    element("p", { className: "soft" }, `Effects found in any run, and fitted to all: ${effects}. A change counts from 5 standard deviations.`),
    element("details", {}, element("summary", {}, `All ${changes.length} quantities`), table("All quantities of the trend", heads, rows)),
  ];
}

function describeDrift({ series, placed, line, outliers, isTime, change }, found) {
  const unit = `${series.unit === "1" ? "" : `${series.unit} `}per ${isTime ? "day" : "run"}`;
  const bend = change === undefined ? "" : `, constant up to run ${placed.find(({ x }) => x === change)?.number}, linear from there`;
  const lines = [describeLine(line, unit, bend) ?? `No drift can be stated: it needs 3 runs that determine ${nameOf(series)}.`];
  for (const { number, run, name } of outliers) {
    lines.push(`Outlier: run ${number}${run ? ` of ${instant(run.started)}` : ` (${name})`} is farther from the line through the other runs than chance allows.`);
  }
  if (outliers.length) {
    const without = describeLine(fitLine(placed.filter((point) => !outliers.includes(point)), change), unit, bend);
    if (without) lines.push(`Without ${outliers.length > 1 ? "the outliers" : "it"}: ${without.replace(/^./, (first) => first.toLowerCase())}`);
  }
  if (found) lines.push(`The trend calls ${nameOf(series)} ${found.direction}.`);
  const lost = series.points.length - placed.length;
  if (lost) lines.push(`${lost} runs are no longer in the catalogue, so that their time is not known.`);
  return lines.map((text, k) => element("p", { className: k ? "" : "drift" }, text));
}

/** Drift of a line in words with its interval; null without a line. */
function describeLine(line, unit, bend) {
  if (!line) return null;
  const interval = `95 % interval ${line.ci95.map((bound) => significant(bound, 3)).join(" … ")} ${unit}`;
  const isZero = line.ci95[0] <= 0 && line.ci95[1] >= 0;
  return isZero ? `No drift shows: ${significant(line.slope, 3)} ${unit}, and its ${interval} contains zero${bend}.`
    : `Drift ${significant(line.slope, 3)} ${unit}, ${interval}${bend}.`;
}

function makeValueTable({ series, placed, line, outliers }) {
  const rows = placed.map((point) => [
    `run ${point.number}`,
    point.run ? element("a", { className: "link", href: runAddress(point.run.id) }, localTime(point.run.started)) : point.name,
    significant(point.value), point.ci95 ? point.ci95.map((bound) => significant(bound)).join(" … ") : "not determined",
    line ? significant(line.at(point.x)) : "–", outliers.includes(point) ? "outlier" : "",
  ]);
  const heads = ["Run", `Started (${zone()})`, `Value${inUnit(series.unit)}`, `95 % interval${inUnit(series.unit)}`, `Line${inUnit(series.unit)}`, "Remark"];
  return element("details", {}, element("summary", {}, "Values as a table"), table(`${nameOf(series)} over the runs`, heads, rows));
}

function drawFigure(figure, { series, placed, line, outliers, isTime }) {
  if (!placed.length) {
    figure.replaceChildren();
    return null;
  }
  const place = (point) => (isTime ? new Date(point.run.started).getTime() / 1e3 : point.number);
  const marks = placed.map((point) => ({ ...point, at: place(point), isOutlier: outliers.includes(point) }));
  const bends = line ? placed.filter(({ x }, k) => k === 0 || k === placed.length - 1 || x === line.from) : [];
  const corners = bends.map((point) => [place(point), line.at(point.x)]);
  const label = `${nameOf(series)}${inUnit(series.unit)}: value of each run with its 95 % interval${line ? ", line of the drift dashed" : ""}`;
  return new TrendPlot(figure, { label, description: `${label}; ${placed.length} runs`, marks, corners, isTime });
}

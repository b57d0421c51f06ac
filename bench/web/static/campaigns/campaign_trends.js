// Trends: each identified parameter over the runs of a campaign, with its 95 % intervals.

import { AxesPlot, clearPlots, position } from "../common/axes_plot.js";
import { describeDrive } from "./campaign_words.js";
import { element, instant, significant, spaced } from "../common/format.js";
import { axis, colour, signed } from "../common/plot_style.js";
import { refresh } from "../common/refresh.js";
import { runAddress } from "../common/router.js";
import { rowTable } from "../common/tables.js";

const HEIGHT = 150;
/** Units of the time since the start; the first counts while the campaign is shorter than `below` of them. */
const TIMES = [{ name: "minutes", unit: "min", ms: 60_000, below: 120 }, { name: "hours", unit: "h", ms: 3_600_000, below: Infinity }];

export class CampaignTrends {
  /** Fills a node with a choice of the parameter, and the trends of the chosen one. */
  constructor(node) {
    this.choice = element("select", { id: "trend-parameter" });
    this.places = element("div", { className: "trends" });
    this.label = element("label", {}, "Parameter ", this.choice);
    this.choice.addEventListener("change", () => this.show(this.campaign));
    node.append(this.label, this.places);
    this.plots = [];
  }

  show(campaign) {
    this.campaign = campaign;
    const names = [...new Set(campaign.trends.map(({ parameter }) => parameter))];
    const chosen = names.includes(this.choice.value) ? this.choice.value : names.includes("k0") ? "k0" : names[0];
    refresh(this.choice, names, () => names.map((value) => element("option", { value }, spaced(value))));
    this.label.hidden = !names.length;
    if (names.length) this.choice.value = chosen;
    const trends = campaign.trends.filter(({ parameter }) => parameter === chosen);
    refresh(this.places, [campaign.id, trends], () => this.make(trends));
  }

  make(trends) {
    clearPlots(this.plots);
    if (!trends.length) return [element("p", { className: "soft" }, "No run of this campaign has been identified yet.")];
    return trends.map((trend) => this.figure(trend));
  }

  figure(trend) {
    const name = `${spaced(trend.parameter)}${trend.unit === "1" ? "" : ` [${trend.unit}]`}`;
    const title = `${trend.specimen}, ${trend.method}, ${describeDrive(trend.drive, trend.drive_unit)}`;
    const start = new Date(this.campaign.created);
    const since = TIMES.find(({ ms, below }) => Math.max(...trend.points.map(({ at }) => new Date(at) - start)) < below * ms);
    const place = element("div", { className: "plot", role: "img", "aria-label": `${name} over time, ${title}; the table has the values` });
    requestAnimationFrame(() => place.isConnected && this.plots.push(draw(trend, start, since, place)));
    return element("figure", {}, element("figcaption", {}, `${title}: ${name} over ${since.name} since the start [${since.unit}]`), place, makeTable(trend, title, name));
  }
}

function makeTable({ points }, title, name) {
  const rows = points.map(({ run, at, value, half_width: half, verdict }) => element("tr", {},
    element("th", { scope: "row" }, element("a", { href: runAddress(run) }, instant(at))),
    element("td", { className: "number" }, significant(value)),
    element("td", { className: "number" }, half === null ? "not determined" : `± ${significant(half, 2)}`),
    element("td", {}, verdict ? spaced(verdict) : "–")));
  const heads = ["End of the run", name, "95 % interval", "Diagnosis"];
  return element("details", {}, element("summary", {}, "Values"), rowTable(`Values, ${title}`, heads, rows));
}

/** Draws values as points with their intervals. */
function draw({ points }, start, { ms, unit }, place) {
  const times = points.map(({ at }) => (new Date(at) - start) / ms);
  const values = points.map(({ value }) => value);
  const halves = points.map(({ half_width: half }) => half ?? 0);
  const low = Math.min(...values.map((value, k) => value - halves[k]));
  const high = Math.max(...values.map((value, k) => value + halves[k]));
  const margin = 0.1 * (high - low) || 0.05 * Math.abs(high) || 1;
  const last = Math.max(...times, 1e-3);
  return new AxesPlot(place, {
    least: { width: 160 }, height: HEIGHT, padding: [8, 16, 0, 0],
    scales: { x: { time: false, range: () => [Math.min(0, ...times), last * 1.05] }, y: { range: () => [low - margin, high + margin] } },
    axes: [axis({ size: 28, space: 60, values: (u, all) => all.map((one) => `${one} ${unit}`) }), axis({ size: 64, space: 26, values: signed })],
    series: [{}, { stroke: () => colour("--accent"), width: 1, points: { show: true, size: 7, fill: () => colour("--accent") } }],
    hooks: { draw: [(u) => drawIntervals(u, times, values, halves)] },
  }, [times, values]);
}

function drawIntervals(u, times, values, halves) {
  const { ctx } = u;
  ctx.save();
  ctx.strokeStyle = colour("--accent");
  ctx.lineWidth = devicePixelRatio;
  ctx.beginPath();
  times.forEach((time, k) => {
    if (!halves[k]) return;
    ctx.moveTo(...position(u, time, values[k] - halves[k]));
    ctx.lineTo(...position(u, time, values[k] + halves[k]));
  });
  ctx.stroke();
  ctx.restore();
}

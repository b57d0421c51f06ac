// Plots of a comparison. uPlot draws the axes; lines, markers and band are drawn here, because a loop crosses itself.

import uPlot from "../vendor/uPlot.esm.js";
import { AxesPlot, OWN_CONTENT, drawInside, position } from "../common/axes_plot.js";
import { element } from "../common/format.js";
import { axis, colour, signed } from "../common/plot_style.js";
import { runStyle } from "./run_styles.js";

const LINE_PX = 1.75;
const MARKER_PX = 4.5;
const BAND_OPACITY = 0.25;
const PAD = 0.06; // share of an axis that stays free at each end

const padded = (u, low, high) => uPlot.rangeNum(low, high, PAD, false);

/**
 * Plot of lines of several runs.
 *
 * A line has the `place` of its run, `x`, `y`, and optionally `closed`, `marked`, `unjoined`, and `spread` for error
 * bars. A band has `place`, `x`, `lower`, `upper` and `closed`. A label has `x`, `y` and `text`.
 */
export class RunPlot {
  constructor(figures, { caption, lines, band = null, labels = [], x = {} }) {
    Object.assign(this, { lines, band, labels });
    const place = element("div", { className: "plot", role: "img", "aria-label": caption });
    figures.append(element("figure", {}, element("figcaption", {}, caption), place));
    this.plot = new AxesPlot(place, {
      least: { width: 200, height: 120 }, padding: [10, 14, 0, 0],
      scales: { x: { time: false, range: x.range ? () => x.range : padded }, y: { range: padded } },
      axes: [axis({ size: 26, space: 40, values: signed, ...x.axis }), axis({ size: 56, space: 30, values: signed })],
      series: OWN_CONTENT,
      hooks: { draw: [(u) => drawInside(u, () => this.draw(u))] },
    }, findExtent(lines, band));
  }

  destroy() {
    this.plot.destroy();
  }

  draw(u) {
    if (this.band) fillBand(u, this.band);
    for (const line of this.lines) drawLine(u, line);
    for (const label of this.labels) writeLabel(u, label);
  }
}

/** Smallest and largest x and y, as data of uPlot. */
function findExtent(lines, band) {
  const bounds = (values) => values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
  const spread = (line, sign) => line.y.map((value, k) => value + sign * (line.spread?.[k] ?? 0));
  const edges = band ? [...band.lower, ...band.upper] : [];
  return [bounds(lines.flatMap(({ x }) => x)), bounds([...edges, ...lines.flatMap((line) => [...spread(line, -1), ...spread(line, 1)])])];
}

function fillBand(u, { place, x, lower, upper, closed }) {
  const path = new Path2D();
  const last = closed ? x.length : x.length - 1;
  for (let k = 0; k < last; k++) {
    const next = (k + 1) % x.length;
    // All pieces turn in one direction, so that overlapping ones are filled once.
    const [a, b] = x[k] <= x[next] ? [k, next] : [next, k];
    path.moveTo(...position(u, x[a], lower[a]));
    for (const corner of [[x[b], lower[b]], [x[b], upper[b]], [x[a], upper[a]]]) path.lineTo(...position(u, ...corner));
    path.closePath();
  }
  u.ctx.globalAlpha = BAND_OPACITY;
  u.ctx.fillStyle = colour(runStyle(place).colour);
  u.ctx.fill(path);
  u.ctx.globalAlpha = 1;
}

function drawLine(u, line) {
  const { ctx } = u;
  const style = runStyle(line.place);
  const points = line.x.map((x, k) => position(u, x, line.y[k]));
  ctx.strokeStyle = ctx.fillStyle = colour(style.colour);
  ctx.lineWidth = LINE_PX * devicePixelRatio;
  ctx.setLineDash(style.dash.map((length) => length * devicePixelRatio));
  if (!line.unjoined) trace(ctx, points, line.closed);
  ctx.setLineDash([]);
  if (line.spread) line.spread.forEach((size, k) => drawSpread(u, line.x[k], line.y[k], size));
  if (line.marked) for (const point of points) drawMarker(ctx, point, style.marker);
}

function trace(ctx, points, closed) {
  ctx.beginPath();
  for (const point of points) ctx.lineTo(...point);
  if (closed) ctx.closePath();
  ctx.stroke();
}

function drawSpread(u, x, y, size) {
  const [middle, low] = position(u, x, y - size);
  const [, high] = position(u, x, y + size);
  const half = MARKER_PX * devicePixelRatio;
  trace(u.ctx, [[middle, low], [middle, high]]);
  for (const end of [low, high]) trace(u.ctx, [[middle - half, end], [middle + half, end]]);
}

function drawMarker(ctx, [x, y], marker) {
  const radius = MARKER_PX * devicePixelRatio;
  ctx.beginPath();
  for (const [right, down] of marker) ctx.lineTo(x + radius * right, y + radius * down);
  ctx.fill();
}

function writeLabel(u, { x, y, text }) {
  const [middle, top] = position(u, x, y);
  u.ctx.fillStyle = colour("--soft");
  u.ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
  u.ctx.textBaseline = "bottom";
  u.ctx.textAlign = "center";
  u.ctx.fillText(text, middle, top - 6 * devicePixelRatio);
}

// A figure with a few curves that do not move: legend, units, bands, in both colour schemes.

import { AxesPlot, OWN_CONTENT, drawInside, position } from "./axes_plot.js";
import { element } from "./format.js";
import { axis, colour, signed } from "./plot_style.js";

const HEIGHT = 240;
const MARGIN = 0.06; // share of the span that stays free at each end of the vertical axis

/** Smallest and largest finite value of some lists; `low` is `high` if all are equal. */
function findBounds(lists) {
  let [low, high] = [Infinity, -Infinity];
  for (const list of lists) {
    for (const value of list) {
      if (!Number.isFinite(value)) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return low <= high ? [low, high] : [0, 1];
}

/** Bounds with a margin; equal ones are moved apart. */
function widen([low, high], margin) {
  const span = high - low || Math.abs(high) || 1;
  return high > low ? [low - margin * span, high + margin * span] : [low - span / 2, high + span / 2];
}

/**
 * Figure of curves over x, which need not be functions of x: a loop is drawn in the order of its points.
 *
 * Each curve has `name`, `colour` (of the style sheet), `x`, `y`, and perhaps `dashed` or `wide`. The band has `name`, `colour`,
 * `x`, `low` and `high`. uPlot draws the axes; they have the labels `across` and `up` with their units.
 */
export class CurvePlot {
  constructor({ title, across, up, curves, band = null }) {
    Object.assign(this, { curves, band });
    this.place = element("div", { className: "plot", role: "img", "aria-label": `${title}: ${up} over ${across}` });
    this.figure = element("figure", { className: "curves" },
      element("figcaption", {}, element("strong", {}, title), ` ${up}, over ${across}`, element("span", { className: "legends" }, ...this.legend())), this.place);
    const horizontal = findBounds([...curves.map(({ x }) => x), band?.x ?? []]);
    const vertical = findBounds([...curves.map(({ y }) => y), band?.low ?? [], band?.high ?? []]);
    this.bounds = { x: widen(horizontal, 0), y: widen(vertical, MARGIN) };
  }

  /** Names of curves and band with samples of their lines. */
  legend() {
    const all = [...this.curves, ...(this.band ? [{ ...this.band, isBand: true }] : [])];
    return all.map(({ name, colour: of, dashed, wide, isBand }) => {
      const kind = isBand ? "band" : dashed ? "dashed" : wide ? "wide" : "";
      const sample = element("i", { className: `sample ${kind}`, "aria-hidden": "true" });
      sample.style.color = `var(${of})`;
      return element("span", { className: "legend" }, sample, name);
    });
  }

  /** Draws the figure, which has to be in the page, because it has the width of its place. */
  draw() {
    const { x, y } = this.bounds;
    this.plot = new AxesPlot(this.place, {
      least: { width: 160 }, height: HEIGHT, padding: [8, 14, 0, 0],
      scales: { x: { time: false, range: () => x }, y: { range: () => y } },
      axes: [axis({ size: 26, space: 60, values: signed }), axis({ size: 60, space: 30, values: signed })],
      series: OWN_CONTENT,
      hooks: { draw: [(u) => drawInside(u, () => this.trace(u))] },
    }, [x, y]);
  }

  destroy() {
    this.plot?.destroy();
  }

  trace(u) {
    if (this.band) this.fill(u, this.band);
    for (const curve of this.curves) this.stroke(u, curve);
  }

  fill(u, { x, low, high, colour: of }) {
    const { ctx } = u;
    ctx.beginPath();
    for (let n = 0; n < x.length; n++) ctx.lineTo(...position(u, x[n], high[n]));
    for (let n = x.length - 1; n >= 0; n--) ctx.lineTo(...position(u, x[n], low[n]));
    ctx.fillStyle = colour(of);
    ctx.globalAlpha = 0.2;
    ctx.fill();
    ctx.globalAlpha = 1;
  }

  stroke(u, { x, y, colour: of, dashed, wide }) {
    const { ctx } = u;
    ctx.beginPath();
    for (let n = 0; n < x.length; n++) ctx.lineTo(...position(u, x[n], y[n]));
    ctx.strokeStyle = colour(of);
    ctx.lineWidth = (wide ? 5 : 1.5) * devicePixelRatio;
    ctx.globalAlpha = wide ? 0.5 : 1;
    ctx.lineJoin = "round"; // a mitre would show noise as long spikes
    ctx.setLineDash(dashed ? [5 * devicePixelRatio, 3 * devicePixelRatio] : []);
    ctx.stroke();
  }
}

// Control chart: values of the checks, centre, limits, and the weighted mean that shows a drift.

import { AxesPlot, OWN_CONTENT, drawInside, position } from "../common/axes_plot.js";
import { element, significant } from "../common/format.js";
import { axis, colour } from "../common/plot_style.js";

const HEIGHT = 240;
const RADIUS = 4;
/** Lines by name: colour of the style sheet, and whether the line is dashed. */
const LINES = { centre: ["--soft", false], limits: ["--bad", true], "weighted mean": ["--drive", false] };

export class CheckPlot {
  /**
   * Draws the points of a chart over the number of the check.
   *
   * `unit` and `scale` are those of the displayed quantity, `title` its name.
   */
  constructor(place, { title, unit, scale, points, limits }) {
    this.marks = points.map((point, index) => ({ ...point, at: index + 1, y: scale * point.value, mean: point.ewma === null ? null : scale * point.ewma }));
    this.lines = limits ? [[scale * limits.centre, "centre"], [scale * limits.lower, "limits"], [scale * limits.upper, "limits"]] : [];
    const box = element("div", { className: "plot", role: "img", "aria-label": `${title} of ${points.length} checks in ${unit}; the table below has the values` });
    place.replaceChildren(element("figcaption", {}, element("strong", {}, title), ` in ${unit}, over the number of the check`, this.makeLegend()), box);
    const range = this.findRange();
    this.plot = new AxesPlot(box, {
      least: { width: 160 }, height: HEIGHT, padding: [8, 14, 0, 0],
      scales: { x: { time: false, range: () => [0.5, Math.max(points.length, 2) + 0.5] }, y: { range: () => range } },
      axes: [
        axis({ size: 28, space: 40, incrs: [1, 2, 5, 10, 20, 50, 100, 200, 500] }),
        axis({ size: 76, space: 30, values: (u, splits) => splits.map((value) => significant(value)) }),
      ],
      series: OWN_CONTENT,
      hooks: { draw: [(u) => drawInside(u, () => this.draw(u))] },
    }, [this.marks.map(({ at }) => at), this.marks.map(({ y }) => y)]);
  }

  destroy() {
    this.plot.destroy();
  }

  makeLegend() {
    const lines = Object.entries(this.lines.length ? LINES : {}).map(([name, [of, isDashed]]) => {
      const sample = element("i", { className: `sample ${isDashed ? "dashed" : ""}`, "aria-hidden": "true" });
      sample.style.color = `var(${of})`;
      return element("span", { className: "legend" }, sample, name);
    });
    const words = "hollow: baseline, square: out of control";
    return element("span", { className: "legends" }, ...lines, element("span", { className: "legend" }, words));
  }

  /** Range with all values and lines, and a margin. */
  findRange() {
    const all = [...this.marks.map(({ y }) => y), ...this.lines.map(([y]) => y), ...this.marks.map(({ mean }) => mean).filter((one) => one !== null)];
    const [low, high] = [Math.min(...all), Math.max(...all)];
    const margin = 0.08 * (high - low) || 0.1 * Math.abs(high) || 1;
    return [low - margin, high + margin];
  }

  draw(u) {
    const width = u.scales.x;
    for (const [y, name] of this.lines) drawPath(u, [[width.min, y], [width.max, y]], name);
    drawPath(u, this.marks.filter(({ mean }) => mean !== null).map(({ at, mean }) => [at, mean]), "weighted mean");
    for (const mark of this.marks) drawMark(u, mark);
  }
}

function drawPath(u, corners, name) {
  const { ctx } = u;
  const [of, isDashed] = LINES[name];
  ctx.strokeStyle = colour(of);
  ctx.lineWidth = 1.5 * devicePixelRatio;
  ctx.setLineDash(isDashed ? [6 * devicePixelRatio, 4 * devicePixelRatio] : []);
  ctx.beginPath();
  for (const [x, y] of corners) ctx.lineTo(...position(u, x, y));
  ctx.stroke();
  ctx.setLineDash([]);
}

/** Draws a check: hollow in the baseline, a square if it is out of control. */
function drawMark(u, { at, y, rules, is_baseline: isBaseline }) {
  const { ctx } = u;
  const [left, top] = position(u, at, y);
  const radius = RADIUS * devicePixelRatio;
  ctx.strokeStyle = colour(rules.length ? "--bad" : "--force");
  ctx.fillStyle = isBaseline ? colour("--card") : ctx.strokeStyle;
  ctx.lineWidth = 1.5 * devicePixelRatio;
  ctx.beginPath();
  if (rules.length) ctx.rect(left - radius, top - radius, 2 * radius, 2 * radius);
  else ctx.arc(left, top, radius, 0, 2 * Math.PI);
  ctx.fill();
  ctx.stroke();
}

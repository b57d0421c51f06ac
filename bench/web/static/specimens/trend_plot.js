// Figure of a quantity over the runs: values with 95 % intervals, the line of the drift, and outliers.

import { AxesPlot, OWN_CONTENT, drawInside, position } from "../common/axes_plot.js";
import { element, localTime, significant, zone } from "../common/format.js";
import { axis, colour } from "../common/plot_style.js";

const HEIGHT = 280;
const DAY = 86_400;
const RADIUS = 4;
/** An interval wider than this many median ones is cut off, so that the others stay visible. */
const WIDEST = 8;

export class TrendPlot {
  /**
   * Draws marks `{ at, value, ci95, number, isOutlier }` and the line through the corners `[[at, value], …]`.
   *
   * `at` is UTC in seconds if `isTime`, else the number of the run.
   */
  constructor(place, { label, description, marks, corners, isTime }) {
    const box = element("div", { className: "plot trend", role: "img", "aria-label": description });
    place.replaceChildren(element("figcaption", {}, label), box);
    const times = marks.map(({ at }) => at);
    this.plot = new AxesPlot(box, {
      least: { width: 200 }, height: HEIGHT, padding: [14, 16, 0, 0],
      scales: { x: { time: isTime, range: () => pad(times, isTime) }, y: { range: () => findRange(marks, corners) } },
      axes: [
        axis({ size: 28, labelSize: 18, ...(isTime ? timeAxis(times) : numberAxis) }),
        axis({ size: 76, space: 30, values: (u, splits) => splits.map((value) => significant(value)) }),
      ],
      series: OWN_CONTENT,
      hooks: { draw: [(u) => drawInside(u, () => draw(u, marks, corners))] },
    }, [times, marks.map(({ value }) => value)]);
  }

  destroy() {
    this.plot.destroy();
  }
}

const numberAxis = {
  label: "Number of the run, the oldest first", space: 30, incrs: [1, 2, 5, 10, 20, 50],
  values: (u, splits) => splits.map((number) => String(number)),
};

/** Axis of local time; the zone stands beside it, or both zones where a change of the clock lies between. */
function timeAxis(times) {
  const zones = [...new Set([Math.min(...times), Math.max(...times)].map((time) => zone(new Date(1e3 * time))))];
  return {
    label: `Start of the run, local time ${zones.join(" to ")}`, space: 96,
    values: (u, splits, index, space, step) => splits.map((time) => {
      const text = localTime(1e3 * time);
      return step >= DAY ? text.slice(0, 10) : text.slice(5, 16);
    }),
  };
}

function pad(times, isTime) {
  const [low, high] = [Math.min(...times), Math.max(...times)];
  const margin = isTime ? Math.max(0.06 * (high - low), 1800) : 0.5;
  return [low - margin, high + margin];
}

/** Range that contains all values, the line, and all intervals that are not much wider than the others. */
function findRange(marks, corners) {
  const intervals = marks.map(({ ci95 }) => ci95).filter(Boolean);
  const widths = intervals.map(([low, high]) => high - low).sort((a, b) => a - b);
  const widest = WIDEST * (widths[Math.floor(widths.length / 2)] ?? 0);
  const shown = intervals.filter(([low, high]) => high - low <= widest).flat();
  const all = [...shown, ...marks.map(({ value }) => value), ...corners.map(([, value]) => value)];
  const [low, high] = [Math.min(...all), Math.max(...all)];
  const margin = 0.08 * (high - low) || 0.1 * Math.abs(high) || 1;
  return [low - margin, high + margin];
}

function draw(u, marks, corners) {
  drawLine(u, corners);
  for (const mark of marks) drawMark(u, mark);
}

function drawLine(u, corners) {
  const { ctx } = u;
  ctx.strokeStyle = colour("--drive");
  ctx.lineWidth = 2 * devicePixelRatio;
  ctx.setLineDash([8 * devicePixelRatio, 5 * devicePixelRatio]);
  ctx.beginPath();
  for (const [at, value] of corners) ctx.lineTo(...position(u, at, value));
  ctx.stroke();
  ctx.setLineDash([]);
}

/** Draws a value: filled with its interval, hollow where the run does not determine it, an outlier as a named square. */
function drawMark(u, { at, value, ci95, number, isOutlier }) {
  const { ctx } = u;
  const [x, y] = position(u, at, value);
  const radius = RADIUS * devicePixelRatio;
  ctx.strokeStyle = ctx.fillStyle = colour(isOutlier ? "--bad" : "--force");
  ctx.lineWidth = 1.5 * devicePixelRatio;
  ctx.beginPath();
  if (ci95) {
    const [low, high] = ci95.map((bound) => u.valToPos(bound, "y", true));
    ctx.moveTo(x, low);
    ctx.lineTo(x, high);
    for (const end of [low, high]) {
      ctx.moveTo(x - radius, end);
      ctx.lineTo(x + radius, end);
    }
  }
  ctx.stroke();
  ctx.beginPath();
  if (isOutlier) ctx.rect(x - 1.4 * radius, y - 1.4 * radius, 2.8 * radius, 2.8 * radius);
  else ctx.arc(x, y, radius, 0, 2 * Math.PI);
  if (ci95) ctx.fill();
  ctx.stroke();
  if (isOutlier) {
    Object.assign(ctx, { font: `${12 * devicePixelRatio}px system-ui, sans-serif`, textAlign: "left", textBaseline: "middle" });
    ctx.fillText(`run ${number}`, x + 2.4 * radius, y);
  }
}

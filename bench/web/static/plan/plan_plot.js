// Plot of a planned quantity over the time of a method.

import { AxesPlot } from "../common/axes_plot.js";
import { element } from "../common/format.js";
import { axis, colour, signed } from "../common/plot_style.js";
import { QUANTITIES } from "../common/quantities.js";

const HEIGHT = 170;

/** Plots displacement and drive of a preview. */
export const plotPreview = (preview, places) => [
  new PlanPlot(QUANTITIES.displacement, preview.displacement_m, preview, places),
  new PlanPlot({ ...QUANTITIES.drive, unit: preview.drive_unit }, preview.drive, preview, places),
];

class PlanPlot {
  /** Draws a reduced series of a preview; thin lines separate its segments. */
  constructor(quantity, series, preview, places) {
    const label = `${quantity.label} [${quantity.unit}]`;
    const place = element("div", { className: "plot", role: "img", "aria-label": `${label} over ${preview.duration_s} seconds` });
    places.append(element("figure", {}, element("figcaption", {}, label), place));
    this.plot = new AxesPlot(place, {
      least: { width: 200 }, height: HEIGHT, padding: [8, 12, 0, 0],
      scales: { x: { time: false, range: () => [0, preview.duration_s] } },
      axes: [axis({ size: 28, space: 60, values: (u, all) => all.map((s) => `${s} s`) }), axis({ size: 52, space: 24, values: signed })],
      series: [{}, { stroke: () => colour(quantity.colour), width: 1, points: { show: false } }],
      hooks: { drawAxes: [(u) => separate(u, preview.segments)] },
    }, [series.time_s, series.values.map((value) => value * quantity.scale)]);
  }

  destroy() {
    this.plot.destroy();
  }
}

function separate(u, segments) {
  const { ctx, bbox } = u;
  ctx.save();
  ctx.strokeStyle = colour("--edge");
  ctx.lineWidth = 1;
  ctx.beginPath();
  for (const { start_s: start } of segments) {
    const x = Math.round(u.valToPos(start, "x", true)) + 0.5;
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
  }
  ctx.globalAlpha = 0.5;
  ctx.stroke();
  ctx.restore();
}

// Plot whose axes uPlot draws, and that follows the size of its place and the colour scheme.

import uPlot from "../vendor/uPlot.esm.js";
import { DARK, QUIET } from "./plot_style.js";

/** Series without lines, for a plot whose hook `draw` draws its content. */
export const OWN_CONTENT = [{}, { paths: () => null, points: { show: false } }];

/** uPlot in a place of the page. */
export class AxesPlot {
  /**
   * Takes the place, which is in the page, and uPlot's options with its data.
   *
   * `least` is the smallest width and height [px]; `height` replaces that of the place. `onChange` is called after each
   * change of the size or the scheme.
   */
  constructor(place, { least, height, ...options }, data, onChange = () => {}) {
    const size = () => ({ width: Math.max(least.width, place.clientWidth), height: height ?? Math.max(least.height, place.clientHeight) });
    this.plot = new uPlot({ ...QUIET, ...options, ...size() }, data, place);
    this.watch = new ResizeObserver(() => {
      this.plot.setSize(size());
      onChange();
    });
    this.watch.observe(place);
    this.onScheme = () => {
      this.plot.redraw(false, true);
      onChange();
    };
    DARK.addEventListener("change", this.onScheme);
  }

  destroy() {
    this.watch.disconnect();
    DARK.removeEventListener("change", this.onScheme);
    this.plot.destroy();
  }
}

/** Draws between the axes only; the state of the canvas is as before afterwards. */
export function drawInside(u, draw) {
  const { ctx, bbox } = u;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  draw(ctx);
  ctx.restore();
}

/** Place of a pair of values on the canvas. */
export const position = (u, x, y) => [u.valToPos(x, "x", true), u.valToPos(y, "y", true)];

/** Destroys figures and forgets them. */
export function clearPlots(plots) {
  for (const plot of plots.splice(0)) plot.destroy();
}

// Frame of a live plot: uPlot draws the axes when their bounds change, a canvas above them the traces with each frame.

import { AxesPlot, OWN_CONTENT } from "../common/axes_plot.js";

/** Axes and a canvas for traces, which follow the size of their container. */
export class PlotFrame {
  /** Takes the container, uPlot's options for the axes, and the bounds of both axes; `onResize` draws the traces again. */
  constructor(place, options, bounds, onResize) {
    this.bounds = bounds;
    const scale = (k) => ({ time: false, range: () => this.bounds[k] });
    const content = { scales: { x: scale(0), y: scale(1) }, series: OWN_CONTENT };
    this.axes = new AxesPlot(place, { least: { width: 120, height: 60 }, ...options, ...content }, this.data, onResize);
    this.plot = this.axes.plot;
    this.canvas = document.createElement("canvas");
    this.canvas.className = "trace";
    this.plot.over.append(this.canvas);
  }

  /** Values that make uPlot draw its axes again, and nothing else. */
  get data() {
    return [this.bounds[0], [null, null]];
  }

  get width() {
    return this.plot.over.clientWidth;
  }

  /** Sets the bounds of both axes. The axes are drawn only after a change: that is most of the work of a frame. */
  setBounds(across, up) {
    const old = this.bounds.flat();
    if ([...across, ...up].every((value, k) => value === old[k])) return;
    this.bounds = [across, up];
    this.plot.setData(this.data);
  }

  /** Clears the canvas; returns its context, in pixels of the style sheet, and the functions from values to pixels. */
  begin() {
    const { clientWidth: width, clientHeight: height } = this.plot.over;
    const [wide, high] = [width, height].map((length) => Math.round(length * devicePixelRatio));
    if (this.canvas.width !== wide || this.canvas.height !== high) Object.assign(this.canvas, { width: wide, height: high });
    const context = this.canvas.getContext("2d");
    context.setTransform(devicePixelRatio, 0, 0, devicePixelRatio, 0, 0);
    context.clearRect(0, 0, width, height);
    const [[left, right], [bottom, top]] = this.bounds;
    const [kx, ky] = [width / (right - left), height / (top - bottom)];
    return { context, toX: (value) => (value - left) * kx, toY: (value) => (top - value) * ky };
  }

  destroy() {
    this.axes.destroy();
  }
}

// Live plots with uPlot: traces of the last ten seconds, and force against displacement.

import uPlot from "./vendor/uPlot.esm.js";
import { element, write } from "./format.js";
import { envelope } from "./ring.js";

export const STRIP_SECONDS = 10;
const LOOP_SECONDS = 2;
const LOOP_PIECES = 12;
const LEAST_STEP_PX = 1; // shorter steps of a loop are not visible
const SHRINK_AFTER_MS = 2_000;
/** Pause after a frame as a share of its time, so that a slow device still has time for the person. */
const REST_SHARE = 0.4;
const MARGIN = 0.03; // share of an axis that stays free at each end

/** Bounds of an axis that grow at once and shrink late, so that a moving plot stays readable. */
class AxisRange {
  constructor(quantity) {
    this.quantity = quantity;
    this.reset();
  }

  /** Smallest span, in the unit of the quantity. */
  get least() {
    return this.quantity.least * this.quantity.scale;
  }

  reset() {
    this.held = [-this.least / 2, this.least / 2];
    this.filledAt = 0;
    this.unit = this.quantity.unit;
  }

  /** Returns the bounds for values from `low` to `high`. */
  hold(low, high) {
    if (this.unit !== this.quantity.unit) this.reset();
    if (!Number.isFinite(low) || !Number.isFinite(high)) return this.held;
    const [bottom, top] = this.held;
    const now = performance.now();
    const fills = high - low > 0.4 * (top - bottom) || top - bottom <= this.least * 1.5;
    if (fills) this.filledAt = now;
    const margin = MARGIN * (top - bottom);
    if (low < bottom + margin || high > top - margin || now - this.filledAt > SHRINK_AFTER_MS) {
      this.held = this.around(low, high);
      this.filledAt = now;
    }
    return this.held;
  }

  around(low, high) {
    const span = Math.max((high - low) * 1.15, this.least);
    const middle = (low + high) / 2;
    const step = roundStep(span / 12);
    return [Math.floor((middle - span / 2) / step) * step, Math.ceil((middle + span / 2) / step) * step];
  }
}

/** Rounds up to 1, 2 or 5 times a power of ten. */
function roundStep(size) {
  const power = 10 ** Math.floor(Math.log10(size));
  return power * [1, 2, 5, 10].find((digit) => digit * power >= size * (1 - 1e-9));
}

const DARK = matchMedia("(prefers-color-scheme: dark)");
const colours = new Map(); // kept, because reading a style many times in each frame is slow
DARK.addEventListener("change", () => colours.clear());

/** Value of a colour of the style sheet in the present scheme. */
export function colour(name) {
  if (!colours.has(name)) colours.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  return colours.get(name);
}

const FONT = "11px system-ui, 'Segoe UI', Roboto, sans-serif";

export function axis(more) {
  return {
    stroke: () => colour("--soft"), font: FONT, labelFont: FONT, gap: 4,
    grid: { stroke: () => colour("--line"), width: 1 }, ticks: { show: false }, ...more,
  };
}

export const signed = (u, splits) => splits.map((value) => String(value).replace("-", "−"));
const secondsAgo = (u, splits) => splits.map((s) => (s === -STRIP_SECONDS ? "" : `${s} s`.replace("-", "−")));
const unlabelled = (u, splits) => splits.map(() => "");
export const QUIET = { cursor: { show: false }, legend: { show: false }, select: { show: false } };

/** Creates a uPlot that fills its container and follows its size. */
function fitted(place, options, data, afterwards) {
  const size = () => ({ width: Math.max(120, place.clientWidth), height: Math.max(60, place.clientHeight) });
  const plot = new uPlot({ ...QUIET, ...options, ...size() }, data, place);
  new ResizeObserver(() => {
    plot.setSize(size());
    afterwards();
  }).observe(place);
  return plot;
}

/** Trace of one quantity over the last ten seconds. */
class Strip {
  constructor(ring, quantity, { place, caption, last, redraw }) {
    Object.assign(this, { ring, quantity, caption });
    this.data = [[], []];
    write(caption, this.label());
    const range = new AxisRange(quantity);
    this.plot = fitted(place, {
      padding: [8, 12, last ? 0 : 8, 0],
      scales: { x: { time: false, range: () => [-STRIP_SECONDS, 0] }, y: { range: (u, low, high) => range.hold(low, high) } },
      axes: [
        axis({ size: last ? 22 : 0, space: 60, values: last ? secondsAgo : unlabelled }),
        axis({ size: 52, space: 16, values: signed }),
      ],
      series: [{}, { stroke: () => colour(quantity.colour), width: 1.25, pxAlign: 0, points: { show: false } }],
    }, this.data, redraw);
  }

  label() {
    return named(this.quantity);
  }

  draw() {
    const bins = Math.max(100, Math.round(this.plot.width));
    this.plot.setData(envelope(this.ring, this.quantity, STRIP_SECONDS, bins, this.data));
  }
}

/** One quantity against another, with older parts fading. uPlot draws only the axes: the loop is no function of x. */
class Loop {
  constructor(ring, across, up, { place, caption, redraw }) {
    Object.assign(this, { ring, across, up, caption });
    write(caption, this.label());
    const ranges = [new AxisRange(across), new AxisRange(up)];
    const scale = (range) => ({ time: false, range: (u, low, high) => range.hold(low, high) });
    this.plot = fitted(place, {
      padding: [10, 14, 0, 0],
      scales: { x: scale(ranges[0]), y: scale(ranges[1]) },
      axes: [axis({ size: 24, space: 50, values: signed }), axis({ size: 52, space: 34, values: signed })],
      series: [{}, { paths: () => null, points: { show: false } }],
      hooks: { draw: [(u) => this.trace(u)] },
    }, [ranges[0].held, [null, null]], redraw);
  }

  label() {
    return `${named(this.up)} against ${named(this.across).replace(/^./, (first) => first.toLowerCase())}`;
  }

  draw() {
    const { ring, across, up } = this;
    const x = ring.recent(across.field, LOOP_SECONDS);
    const y = ring.recent(up.field, LOOP_SECONDS);
    this.plot.setData([[x.low * across.scale, x.high * across.scale], [y.low * up.scale, y.high * up.scale]]);
  }

  trace(u) {
    const { ctx, bbox } = u;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.strokeStyle = ctx.fillStyle = colour(this.up.colour);
    ctx.lineWidth = 1.5 * devicePixelRatio;
    const first = this.ring.firstSince(this.ring.newest - LOOP_SECONDS);
    const piece = Math.ceil((this.ring.end - first) / LOOP_PIECES);
    for (let k = 0; k < LOOP_PIECES; k++) {
      ctx.globalAlpha = 0.12 + 0.88 * ((k + 1) / LOOP_PIECES) ** 2;
      this.stroke(u, first + k * piece, Math.min(first + (k + 1) * piece + 1, this.ring.end));
    }
    this.dot(u);
    ctx.restore();
  }

  stroke(u, from, to) {
    let [lastX, lastY] = [NaN, NaN];
    u.ctx.beginPath();
    for (let n = from; n < to; n++) {
      const [x, y] = this.position(u, n % this.ring.capacity);
      if (n < to - 1 && Math.abs(x - lastX) + Math.abs(y - lastY) < LEAST_STEP_PX) continue;
      u.ctx.lineTo(x, y); // a canvas ignores points that are NaN
      [lastX, lastY] = [x, y];
    }
    u.ctx.stroke();
  }

  dot(u) {
    if (!this.ring.end) return;
    const [x, y] = this.position(u, (this.ring.end - 1) % this.ring.capacity);
    u.ctx.beginPath();
    u.ctx.arc(x, y, 4 * devicePixelRatio, 0, 2 * Math.PI);
    u.ctx.fill();
  }

  position(u, at) {
    const { across, up, ring } = this;
    return [
      u.valToPos(ring.values[across.field][at] * across.scale, "x", true),
      u.valToPos(ring.values[up.field][at] * up.scale, "y", true),
    ];
  }
}

/** All live plots; they are drawn with the frames of the browser, and only after new samples. */
export class LivePlots {
  /** `reveal` is called before each frame and decides up to which sample the ring is shown. */
  constructor(ring, quantities, { loops, strips }, reveal = () => {}) {
    Object.assign(this, { ring, reveal, place: loops });
    this.drawn = -1;
    this.restUntil = 0;
    const redraw = () => { this.drawn = -1; };
    const { force, displacement, velocity, drive, temperature } = quantities;
    const crossed = [displacement, velocity].map((across) => loop(ring, across, force, loops, redraw));
    const traced = [force, displacement, drive, temperature];
    this.plots = [...crossed, ...traced.map((one, k) => strip(ring, one, strips, k === traced.length - 1, redraw))];
    DARK.addEventListener("change", () => {
      for (const { plot } of this.plots) plot.redraw(false, true);
    });
    const onFrame = () => {
      if (this.isDestroyed) return;
      this.draw();
      requestAnimationFrame(onFrame);
    };
    requestAnimationFrame(onFrame);
  }

  draw() {
    this.reveal();
    if (!this.place.checkVisibility()) return;
    const began = performance.now();
    if (!this.ring.end || this.drawn === this.ring.end || began < this.restUntil) return;
    this.drawn = this.ring.end;
    for (const plot of this.plots) plot.draw();
    const ended = performance.now();
    this.restUntil = ended + REST_SHARE * (ended - began);
  }

  /** Ends the drawing and releases the plots. */
  destroy() {
    this.isDestroyed = true;
    for (const { plot } of this.plots) plot.destroy();
  }

  /** Writes the captions again, after a unit has changed. */
  relabel() {
    this.drawn = -1;
    for (const plot of this.plots) write(plot.caption, plot.label());
  }
}

const named = (quantity) => `${quantity.label} [${quantity.unit}]`;

function loop(ring, across, up, loops, redraw) {
  const caption = element("figcaption");
  const label = `${up.label} against ${across.label.toLowerCase()}, last ${LOOP_SECONDS} seconds`;
  const place = element("div", { className: "plot", role: "img", "aria-label": label });
  loops.append(element("figure", { className: "loop" }, caption, place));
  return new Loop(ring, across, up, { place, caption, redraw });
}

function strip(ring, quantity, strips, last, redraw) {
  const caption = element("figcaption");
  const label = `${quantity.label}, last ${STRIP_SECONDS} seconds`;
  const place = element("div", { className: "plot", role: "img", "aria-label": label });
  strips.append(element("figure", { className: last ? "strip last" : "strip" }, caption, place));
  return new Strip(ring, quantity, { place, caption, last, redraw });
}

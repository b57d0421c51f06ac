// Live plots: traces of the last ten seconds, and force against displacement and velocity.

import { AxisRange } from "./axis_range.js";
import { element, write } from "../common/format.js";
import { PlotFrame } from "./plot_frame.js";
import { axis, colour, signed } from "../common/plot_style.js";
import { envelope } from "./ring.js";

export const STRIP_SECONDS = 10;
const LOOP_SECONDS = 2;
const LOOP_PIECES = 12;
const LEAST_STEP_PX = 1; // shorter steps of a loop are not visible
/** Pause after a frame as a share of its time, so that a slow device still has time for the person. */
const REST_SHARE = 0.4;

const secondsAgo = (u, splits) => splits.map((s) => (s === -STRIP_SECONDS ? "" : `${s} s`.replace("-", "−")));
const unlabelled = (u, splits) => splits.map(() => "");

/** Trace of one quantity over the last ten seconds. */
class Strip {
  constructor(ring, quantity, { place, caption, last, redraw }) {
    Object.assign(this, { ring, quantity, caption, range: new AxisRange(quantity), data: [[], []] });
    write(caption, this.label());
    this.frame = new PlotFrame(place, {
      padding: [8, 12, last ? 0 : 8, 0],
      axes: [
        axis({ size: last ? 22 : 0, space: 60, values: last ? secondsAgo : unlabelled }),
        axis({ size: 52, space: 16, values: signed }),
      ],
    }, [[-STRIP_SECONDS, 0], this.range.held], redraw);
  }

  label() {
    return named(this.quantity);
  }

  draw() {
    const { ring, quantity, frame } = this;
    const bins = Math.max(100, Math.round(frame.width));
    const [times, values] = envelope(ring, quantity, STRIP_SECONDS, bins, this.data);
    frame.setBounds([-STRIP_SECONDS, 0], this.range.hold(...extremes(values)));
    const { context, toX, toY } = frame.begin();
    context.strokeStyle = colour(quantity.colour);
    context.lineWidth = 1.25;
    context.beginPath();
    let move = true;
    for (let k = 0; k < times.length; k++) {
      const at = [toX(times[k]), values[k] === null ? NaN : toY(values[k])];
      if (values[k] !== null) context[move ? "moveTo" : "lineTo"](...at);
      move = values[k] === null;
    }
    context.stroke();
  }
}

/** One quantity against another, with older parts fading. */
class Loop {
  constructor(ring, across, up, { place, caption, redraw }) {
    Object.assign(this, { ring, across, up, caption, ranges: [new AxisRange(across), new AxisRange(up)] });
    write(caption, this.label());
    this.frame = new PlotFrame(place, {
      padding: [10, 14, 0, 0],
      axes: [axis({ size: 24, space: 50, values: signed }), axis({ size: 52, space: 34, values: signed })],
    }, this.ranges.map(({ held }) => held), redraw);
  }

  label() {
    return `${named(this.up)} against ${named(this.across).replace(/^./, (first) => first.toLowerCase())}`;
  }

  draw() {
    const { ring, frame } = this;
    const bounds = [this.across, this.up].map(({ field, scale }, k) => {
      const { low, high } = ring.recent(field, LOOP_SECONDS);
      return this.ranges[k].hold(low * scale, high * scale);
    });
    frame.setBounds(...bounds);
    const { context, toX, toY } = frame.begin();
    context.strokeStyle = context.fillStyle = colour(this.up.colour);
    context.lineWidth = 1.5;
    const [x, y] = [this.read(this.across, toX), this.read(this.up, toY)];
    const first = ring.firstSince(ring.newest - LOOP_SECONDS);
    const piece = Math.ceil((ring.end - first) / LOOP_PIECES);
    for (let k = 0; k < LOOP_PIECES; k++) {
      context.globalAlpha = 0.12 + 0.88 * ((k + 1) / LOOP_PIECES) ** 2;
      strokePath(context, x, y, first + k * piece, Math.min(first + (k + 1) * piece + 1, ring.end));
    }
    if (ring.end) drawDot(context, x(ring.end - 1), y(ring.end - 1));
  }

  /** Returns a function from the number of a sample to its place in pixels. */
  read({ field, scale }, toPixel) {
    const { values, capacity } = this.ring;
    const column = values[field];
    return (n) => toPixel(column[n % capacity] * scale);
  }
}

function strokePath(context, x, y, from, to) {
  let [lastX, lastY] = [NaN, NaN];
  context.beginPath();
  for (let n = from; n < to; n++) {
    const [atX, atY] = [x(n), y(n)];
    if (n < to - 1 && Math.abs(atX - lastX) + Math.abs(atY - lastY) < LEAST_STEP_PX) continue;
    context.lineTo(atX, atY); // a canvas ignores points that are NaN
    [lastX, lastY] = [atX, atY];
  }
  context.stroke();
}

function drawDot(context, x, y) {
  context.beginPath();
  context.arc(x, y, 4, 0, 2 * Math.PI);
  context.fill();
}

/** Lowest and highest of some values, without the nulls; NaN if there are none. */
function extremes(values) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    if (value === null) continue;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  return low <= high ? [low, high] : [NaN, NaN];
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
    for (const { frame } of this.plots) frame.destroy();
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

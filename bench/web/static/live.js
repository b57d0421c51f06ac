// Websocket to the service, and the live readings as numbers.

import { liveAddress } from "./api.js";
import { element, fixed, write } from "./format.js";

const RETRY_MS = [500, 1_000, 2_000, 5_000];
const SILENCE_LIMIT_MS = 6_000;
const FRESH_S = 2.5;

/** Describes a quantity for display. */
function quantity(field, label, unit, digits, least, colour, more = {}) {
  return { field, label, unit, digits, least, colour, scale: 1, hole: 0.1, ...more };
}

/**
 * Displayed quantities: `scale` from SI to the unit, `least` span of an axis in that unit, and `hole`, the time [s]
 * without values after which a trace is interrupted; it is long for the temperature, which is sampled slowly.
 */
export const QUANTITIES = {
  force: quantity("force", "Force", "N", 1, 20, "--force"),
  displacement: quantity("displacement", "Displacement", "mm", 2, 2, "--displacement", { scale: 1e3 }),
  velocity: quantity("velocity", "Velocity", "mm/s", 1, 20, "--velocity", { scale: 1e3 }),
  drive: quantity("coil_drive", "Drive", "V", 3, 0.1, "--drive"),
  voltage: quantity("coil_voltage", "Coil voltage", "V", 3, 0.1, "--drive"),
  current: quantity("coil_current", "Coil current", "A", 3, 0.1, "--drive"),
  temperature: quantity("temperature", "Temperature", "°C", 1, 2, "--temperature", { hole: 2.5 }),
};
const READ = ["force", "displacement", "velocity", "voltage", "current", "temperature"];
export const FIELDS = Object.values(QUANTITIES).map((quantity) => quantity.field);

/** Copies the drive to the coil voltage or current that it commands, if that has no separate channel. */
export function fillCoilChannel(samples, driveKind) {
  const own = { coil_v: "coil_voltage", coil_a: "coil_current" }[driveKind];
  const { coil_drive: drive } = samples.values;
  if (!own || samples.values[own] || !drive) return samples;
  return { ...samples, values: { ...samples.values, [own]: drive } };
}

/** Websocket that is opened again whenever it closes or is silent. */
export class LiveLink {
  constructor({ onMessage, onClosed, onReopened }) {
    Object.assign(this, { onMessage, onClosed, onReopened });
    this.failures = 0;
    this.lastMessageAt = 0;
  }

  open() {
    this.close();
    const socket = new WebSocket(liveAddress());
    this.socket = socket;
    this.lastMessageAt = performance.now();
    socket.onopen = () => this.failures && this.onReopened();
    socket.onmessage = ({ data }) => {
      this.failures = 0;
      this.lastMessageAt = performance.now();
      this.onMessage(JSON.parse(data));
    };
    socket.onclose = () => this.socket === socket && this.closed();
    this.watch = setInterval(() => performance.now() - this.lastMessageAt > SILENCE_LIMIT_MS && this.closed(), 1_000);
  }

  closed() {
    this.close();
    const wait = RETRY_MS[Math.min(this.failures++, RETRY_MS.length - 1)];
    this.retry = setTimeout(() => this.open(), wait);
    this.onClosed();
  }

  /** Closes the websocket until `open` is called. */
  close() {
    clearInterval(this.watch);
    clearTimeout(this.retry);
    const socket = this.socket;
    this.socket = null;
    socket?.close();
  }
}

/** Readings as numbers with unit and extremes; updated five times a second, which is readable without flicker. */
export class Readings {
  constructor(ring, place, seconds) {
    Object.assign(this, { ring, seconds, written: -1 });
    this.rows = READ.map((name) => this.row(QUANTITIES[name], place));
    setInterval(() => this.write(), 200);
  }

  row(quantity, place) {
    const number = element("span", { className: "value" }, "–");
    const extremes = element("dd", { className: "extremes" }, "–");
    place.append(element("div", {},
      element("dt", {}, quantity.label),
      element("dd", { className: "now" }, number, element("span", { className: "unit" }, ` ${quantity.unit}`)),
      extremes));
    return { quantity, number, extremes };
  }

  write() {
    if (this.written === this.ring.written) return;
    this.written = this.ring.written;
    for (const { quantity, number, extremes } of this.rows) {
      const { last, low, high } = this.ring.recent(quantity.field, this.seconds, FRESH_S);
      const shown = (value) => fixed(value * quantity.scale, quantity.digits);
      write(number, shown(last));
      write(extremes, Number.isNaN(low) ? "no reading" : `${shown(low)} … ${shown(high)}`);
    }
  }
}

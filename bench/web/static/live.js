// Websocket to the service.

import { liveAddress, token } from "./api.js";

const RETRY_MS = [500, 1_000, 2_000, 5_000];
const SILENCE_LIMIT_MS = 6_000;

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
    socket.onopen = () => {
      socket.send(JSON.stringify({ token: token() ?? "" })); // the first message; an address would be logged
      if (this.failures) this.onReopened();
    };
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

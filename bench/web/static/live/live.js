// Websocket to the service.

import { liveAddress } from "../common/api.js";
import { withBench } from "../common/bench.js";
import { signedIn } from "../common/session.js";
import { parseBatch } from "./live_batch.js";

const RETRY_MS = [500, 1_000, 2_000, 5_000];
const SILENCE_LIMIT_MS = 6_000;

/** Copies the drive to the coil voltage or current that it commands, if that has no separate channel. */
export function fillCoilChannel(batch, driveKind) {
  const own = { coil_v: "coil_voltage", coil_a: "coil_current" }[driveKind];
  const { coil_drive: drive } = batch.columns;
  if (!own || batch.columns[own] || !drive) return batch;
  return { ...batch, columns: { ...batch.columns, [own]: drive } };
}

/** Websocket that is opened again whenever it closes or is silent. */
export class LiveLink {
  /** Takes functions for text messages, batches of samples, the end of a connection and a new one. */
  constructor({ onMessage, onBatch, onClosed, onReopened }) {
    Object.assign(this, { onMessage, onBatch, onClosed, onReopened });
    this.channels = [];
    this.failures = 0;
    this.lastMessageAt = 0;
  }

  open() {
    this.close();
    const socket = new WebSocket(liveAddress());
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    this.lastMessageAt = performance.now();
    socket.onopen = () => {
      socket.send(JSON.stringify(withBench({ csrf: signedIn()?.csrf ?? "", acknowledge: true }))); // another site does not know this value
      if (this.failures) this.onReopened();
    };
    socket.onmessage = ({ data }) => {
      this.failures = 0;
      this.lastMessageAt = performance.now();
      if (typeof data === "string") this.read(JSON.parse(data));
      else this.readBatch(socket, data);
    };
    socket.onclose = () => this.socket === socket && this.closed();
    this.watch = setInterval(() => performance.now() - this.lastMessageAt > SILENCE_LIMIT_MS && this.closed(), 1_000);
  }

  read(message) {
    if (message.topic === "channels") this.channels = message.data.channels;
    else this.onMessage(message);
  }

  /** Passes a batch on and acknowledges it: a page that was held up then gets fresh samples instead of old ones. */
  readBatch(socket, data) {
    const batch = parseBatch(data, this.channels);
    this.onBatch(batch);
    if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ received: batch.sequence }));
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

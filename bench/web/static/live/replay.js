// Replay of a recorded run in the live views: play, pause, speed, and a slider over segments and events.

import { get, post, samples } from "../common/api.js";
import { duration, element, fixed, write } from "../common/format.js";
import { fillCoilChannel } from "./live.js";
import { LivePlots, STRIP_SECONDS } from "./plots.js";
import { FIELDS, QUANTITIES } from "../common/quantities.js";
import { Readings } from "./readings.js";
import { SampleRing } from "./ring.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 20];
/** Recorded time [s] that one request fetches. */
const CHUNK_S = 10;
const STEP_S = 0.1;
/** Largest number of events that one request returns. */
const MAX_EVENTS = 1000;

export class Replay {
  /** Takes a run, and the element for its view. */
  constructor(run, place) {
    Object.assign(this, { run, place, time: 0, speed: 1, playing: false, chunks: new Map() });
    this.path = `runs/${encodeURIComponent(run.id)}`;
    this.ring = new SampleRing(FIELDS, 1 << 17);
  }

  /** Loads segments and events and shows the controls; throws a problem without a log. */
  async open() {
    const [segments, events] = await Promise.all([get(`${this.path}/segments`), get(`${this.path}/events?limit=${MAX_EVENTS}`)]);
    const { items } = events;
    Object.assign(this, { segments: segments.items, events: items.filter(({ time_s: time }) => time !== null && time >= 0) });
    this.driveUnit = segments.drive_unit;
    const { time, started_utc_s: started } = await get(`${this.path}/samples?channel=force&points=1`);
    Object.assign(this, { end: time.at(-1), started: started ?? 0 });
    this.build();
    this.seek(0);
  }

  destroy() {
    this.playing = false;
    this.isDestroyed = true;
    this.plots?.destroy();
    this.readings?.destroy();
  }

  build() {
    const readings = element("dl", { className: "readings" });
    const loops = element("div", { className: "loops" });
    const strips = element("div", { className: "strips" });
    this.source = element("p", { className: "note", role: "status" }, "Replay of a recording, not live. Played from the samples of the log (/bench/sample).");
    this.place.replaceChildren(
      element("h2", {}, "Replay"), this.source, this.controls(), readings,
      element("div", { className: "plots" }, loops, strips));
    this.readings = new Readings(this.ring, readings, STRIP_SECONDS);
    this.plots = new LivePlots(this.ring, QUANTITIES, { loops, strips }, () => this.advance());
  }

  controls() {
    this.button = element("button", { type: "button", className: "primary" }, "Play");
    this.button.addEventListener("click", () => this.toggle());
    const speed = element("select", {}, ...SPEEDS.map((one) => element("option", { value: one, selected: one === 1 }, `${one} ×`)));
    speed.addEventListener("change", () => { this.speed = Number(speed.value); });
    this.slider = element("input", { type: "range", min: 0, max: this.end, step: STEP_S, value: 0, "aria-label": "Time in the recording" });
    this.slider.addEventListener("input", () => this.seek(Number(this.slider.value)));
    this.clock = element("output", { className: "number" });
    const frames = element("button", { type: "button" }, "Check raw frames");
    frames.addEventListener("click", () => this.checkFrames(frames));
    // Without a role of its own: a screen reader has read the name of the mark already.
    this.markText = element("p", { className: "mark-text soft" }, "Press a mark to read it here and to move to its time.");
    return element("div", { className: "replay" },
      element("p", { className: "buttons" }, this.button, element("label", {}, "Speed ", speed), this.clock, frames),
      element("div", { className: "timeline", role: "group", "aria-label": "Segments and events" }, ...this.marks(), this.slider), this.markText);
  }

  /** Marks of segments and events over the slider. Each is a button: its focus shows its text, a press moves to its time. */
  marks() {
    const place = (time) => `${(100 * time) / this.end}%`;
    const go = (mark, time) => {
      for (const kind of ["focus", "click"]) mark.addEventListener(kind, () => this.showMark(mark)); // a touch may give no focus
      mark.addEventListener("click", () => this.seek(time));
    };
    const segments = this.segments.map((one) => {
      const mark = element("button", { type: "button", className: "segment", title: `${one.name}, from ${fixed(one.start_s, 1)} s` }, one.name);
      mark.style.left = place(one.start_s);
      mark.style.width = place(one.stop_s - one.start_s);
      go(mark, one.start_s);
      return mark;
    });
    const events = this.events.filter(({ kind }) => kind !== "state").map((one) => {
      const text = `${one.kind} at ${fixed(one.time_s, 1)} s: ${one.text}`;
      const mark = element("button", { type: "button", className: `event ${one.kind}`, title: text, "aria-label": text }, "◆");
      mark.style.left = place(Math.min(one.time_s, this.end));
      go(mark, one.time_s);
      return mark;
    });
    return [element("div", { className: "segments" }, ...segments), element("div", { className: "marks" }, ...events)];
  }

  /** Shows the text of a mark, which a tablet shows nowhere else. */
  showMark(mark) {
    write(this.markText, mark.title);
    this.markText.classList.remove("soft");
  }

  toggle() {
    this.playing = !this.playing;
    if (this.playing && this.time >= this.end) this.seek(0);
    this.playedAt = performance.now();
    write(this.button, this.playing ? "Pause" : "Play");
  }

  /** Moves to a time [s] and shows the seconds before it. */
  async seek(time) {
    this.time = Math.max(0, Math.min(time, this.end));
    const wanted = (this.wanted = this.time);
    this.show();
    const first = Math.floor(Math.max(0, this.time - STRIP_SECONDS) / CHUNK_S);
    const last = Math.floor(this.time / CHUNK_S);
    const batches = [];
    for (let k = first; k <= last; k++) batches.push(...(await this.load(k)));
    if (wanted !== this.wanted || this.isDestroyed) return; // moved on meanwhile
    this.ring.clear();
    this.next = last + 1;
    for (const batch of batches) this.ring.push(batch);
    this.plots.drawn = -1;
  }

  /** Returns the batches of one part of the recording; they are kept. */
  load(k) {
    if (!this.chunks.has(k)) {
      const query = `format=float32&points=0&from=${k * CHUNK_S}&to=${(k + 1) * CHUNK_S}`;
      this.chunks.set(k, this.fetch(k, `${this.path}/samples?${query}`));
    }
    return this.chunks.get(k);
  }

  async fetch(k, path) {
    try {
      return (await samples(path)).map((batch) => this.shift(batch));
    } catch (problem) {
      this.chunks.delete(k);
      write(this.source, problem.after("The samples cannot be loaded"));
      return [];
    }
  }

  /** Puts a batch on the time of the recording instead of the UTC of its day. */
  shift(batch) {
    return fillCoilChannel({ ...batch, utc: batch.utc - this.started }, this.driveUnit === "A" ? "coil_a" : "coil_v");
  }

  /** Moves on with the frames of the browser while it plays, and shows the samples up to the present time. */
  advance() {
    const now = performance.now();
    if (this.playing && !this.place.checkVisibility()) this.toggle(); // another view was opened
    if (this.playing && this.ring.written) {
      this.time = Math.min(this.end, this.time + (this.speed * (now - this.playedAt)) / 1000);
      this.fetchAhead();
      if (this.time >= this.end) this.toggle();
      this.show();
    }
    this.playedAt = now;
    this.ring.revealUntil(this.time);
  }

  async fetchAhead() {
    const ahead = this.next * CHUNK_S - this.time < CHUNK_S / 2;
    if (!ahead || this.fetching || this.next * CHUNK_S > this.end) return;
    this.fetching = true;
    const { next, wanted } = this;
    const batches = await this.load(next);
    this.fetching = false;
    if (wanted !== this.wanted || this.isDestroyed) return;
    for (const batch of batches) this.ring.push(batch);
    this.next = next + 1;
  }

  show() {
    const segment = this.segments.findLast(({ start_s: start, stop_s: stop }) => start <= this.time && this.time <= stop);
    const words = `${fixed(this.time, 1)} s of ${duration(this.end)}, ${segment?.name ?? "between segments"}`;
    this.slider.value = this.time;
    this.slider.setAttribute("aria-valuetext", words);
    write(this.clock, words);
  }

  /** Decodes the raw frames again on the service and shows whether they give the recorded readings. */
  async checkFrames(button) {
    button.disabled = true;
    write(this.source, "Decoding the raw frames …");
    try {
      const { text } = await post(`${this.path}/replay`, {}, 300_000);
      write(this.source, `Replay of a recording, not live. Played from the samples of the log (/bench/sample). ${text}`);
    } catch (problem) {
      write(this.source, problem.after("The raw frames cannot be decoded"));
    }
    button.disabled = false;
  }
}

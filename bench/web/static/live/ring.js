// Ring buffer of the latest samples in typed arrays, with extremes and envelopes for the plots.

/** Time [s] by which a batch may begin before the newest sample; an earlier one belongs to a clock that went back. */
const MAX_STEP_BACK = 1;

/**
 * Ring buffer of bench samples: time [s] since the first one and a value for each field, NaN if missing. Plots and
 * readings show the samples up to `end`, a number counted from the start; later ones wait for their time.
 */
export class SampleRing {
  constructor(fields, capacity = 1 << 15) {
    this.capacity = capacity;
    this.time = new Float64Array(capacity);
    this.limit = Infinity;
    this.values = Object.fromEntries(fields.map((field) => [field, new Float32Array(capacity)]));
    this.clear();
  }

  clear() {
    this.written = this.end = 0;
    this.origin = null;
  }

  get count() {
    return Math.min(this.written, this.capacity);
  }

  /** Time [s] of the newest shown sample; NaN without samples. */
  get newest() {
    return this.end ? this.time[(this.end - 1) % this.capacity] : NaN;
  }

  /** Time [s] of the newest sample that has arrived; NaN without samples. */
  get latest() {
    return this.written ? this.time[(this.written - 1) % this.capacity] : NaN;
  }

  /** Shows the samples up to a time on the clock of the batches [s]. */
  revealUntil(utc) {
    this.limit = utc;
    this.end = this.origin === null ? 0 : this.firstSince(utc - this.origin);
  }

  /** Adds a live batch, and shows it if its time has come; one that is here already, as after a new connection, is left out. */
  push({ utc, period, count, columns }) {
    this.origin ??= utc;
    const begin = utc - this.origin;
    if (begin < this.latest - MAX_STEP_BACK) {
      this.clear();
      this.push({ utc, period, count, columns });
      return;
    }
    if (begin + (count - 1) * period <= this.latest) return;
    const pairs = Object.entries(this.values).map(([field, column]) => [column, columns[field]]);
    for (let k = 0; k < count; k++) {
      const at = this.written % this.capacity;
      this.time[at] = Math.max(begin + (columns.time ? columns.time[k] : k * period), this.written ? this.latest : -Infinity);
      for (const [column, given] of pairs) column[at] = given ? given[k] : NaN;
      this.written++;
    }
    this.revealUntil(this.limit);
  }

  /** Returns the number, counted from the start, of the first kept sample not before a time [s]. */
  firstSince(from) {
    let low = this.written - this.count;
    let high = this.written;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time[middle % this.capacity] < from) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** Returns the newest value of a field, not older than `fresh` [s], and its extremes over the last seconds. */
  recent(field, seconds, fresh = seconds) {
    const column = this.values[field];
    let [low, high, last] = [Infinity, -Infinity, NaN];
    const freshFrom = this.firstSince(this.newest - fresh);
    for (let n = this.firstSince(this.newest - seconds); n < this.end; n++) {
      const value = column[n % this.capacity];
      if (value < low) low = value;
      if (value > high) high = value;
      if (n >= freshFrom && !Number.isNaN(value)) last = value;
    }
    return { last, low: low <= high ? low : NaN, high: low <= high ? high : NaN };
  }
}

/**
 * Reduces the last seconds of a field to the lowest and highest value of each bin, at their times.
 *
 * The bins are fixed to the clock, not to the window, so that a moving trace does not flicker. A time without values
 * longer than `hole` [s] becomes one null, which interrupts the line.
 *
 * Fills `out[0]` with times [s] relative to the newest sample and `out[1]` with values times `scale`.
 */
export function envelope(ring, { field, scale, hole }, seconds, bins, out) {
  const [times, values] = out;
  const column = ring.values[field];
  const newest = ring.newest;
  const width = seconds / bins;
  times.length = values.length = 0;
  let [bin, low, high, last] = [NaN, -1, -1, NaN];

  const put = (at) => {
    times.push(ring.time[at] - newest);
    values.push(column[at] * scale);
  };
  const flush = () => {
    if (low < 0) return;
    const lowFirst = ring.time[low] <= ring.time[high];
    put(lowFirst ? low : high);
    if (low !== high) put(lowFirst ? high : low);
    low = high = -1;
  };

  for (let n = ring.firstSince(newest - seconds); n < ring.end; n++) {
    const at = n % ring.capacity;
    if (Number.isNaN(column[at])) continue;
    const now = Math.floor(ring.time[at] / width);
    if (now !== bin) flush();
    if (ring.time[at] - last > hole) {
      times.push((last + ring.time[at]) / 2 - newest);
      values.push(null);
    }
    bin = now;
    last = ring.time[at];
    if (low < 0 || column[at] < column[low]) low = at;
    if (high < 0 || column[at] > column[high]) high = at;
  }
  flush();
  return out;
}

// Ring buffer of the latest samples in typed arrays, with extremes and envelopes for the plots.

/** Ring buffer of bench samples: time [s] since the first one and a value for each field, NaN if missing. */
export class SampleRing {
  constructor(fields, capacity = 1 << 14) {
    this.capacity = capacity;
    this.time = new Float64Array(capacity);
    this.values = Object.fromEntries(fields.map((field) => [field, new Float32Array(capacity)]));
    this.clear();
  }

  clear() {
    this.written = 0;
    this.origin = null;
  }

  get count() {
    return Math.min(this.written, this.capacity);
  }

  /** Time [s] of the newest sample; NaN without samples. */
  get newest() {
    return this.written ? this.time[(this.written - 1) % this.capacity] : NaN;
  }

  /** Adds a batch of the agent. A clock that goes back belongs to a restarted agent: the buffer is cleared. */
  push({ time_ns, values }) {
    if (this.origin !== null && (time_ns[0] - this.origin) / 1e9 < this.newest) this.clear();
    this.origin ??= time_ns[0];
    const columns = Object.entries(this.values).map(([field, column]) => [column, values[field]]);
    for (let k = 0; k < time_ns.length; k++) {
      const at = this.written++ % this.capacity;
      this.time[at] = (time_ns[k] - this.origin) / 1e9;
      for (const [column, given] of columns) column[at] = given?.[k] ?? NaN;
    }
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
    for (let n = this.firstSince(this.newest - seconds); n < this.written; n++) {
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

  for (let n = ring.firstSince(newest - seconds); n < ring.written; n++) {
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

// The last samples, in typed arrays of fixed size that are written round and round, and what plots need of them.

/** Ring of bench samples: a time [s] since the first one and a value per field, NaN where there is none. */
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

  /** Time [s] of the newest sample; NaN while there is none. */
  get newest() {
    return this.written ? this.time[(this.written - 1) % this.capacity] : NaN;
  }

  /** Takes a batch as the agent publishes it. A clock that goes back is another agent's: all starts anew. */
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

  /** Number (counted since the start) of the first kept sample not before a time [s]. */
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

  /** Newest value of a field, not older than `fresh` [s], and its extremes over the last seconds. */
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
 * The last seconds of a field, thinned to the least and the greatest value of each bucket at their own times.
 *
 * Buckets lie on the clock, not on the window, so that a trace does not shimmer as it moves. A stretch without values
 * longer than `hole` [s] is one null: a gap in the line.
 *
 * Fills `out[0]` with times [s] relative to the newest sample and `out[1]` with values times `scale`.
 */
export function envelope(ring, { field, scale, hole }, seconds, buckets, out) {
  const [times, values] = out;
  const column = ring.values[field];
  const newest = ring.newest;
  const width = seconds / buckets;
  times.length = values.length = 0;
  let [bucket, low, high, last] = [NaN, -1, -1, NaN];

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
    if (now !== bucket) flush();
    if (ring.time[at] - last > hole) {
      times.push((last + ring.time[at]) / 2 - newest);
      values.push(null);
    }
    bucket = now;
    last = ring.time[at];
    if (low < 0 || column[at] < column[low]) low = at;
    if (high < 0 || column[at] > column[high]) high = at;
  }
  flush();
  return out;
}

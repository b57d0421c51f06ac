// Bounds of the axis of a live plot.

const SHRINK_AFTER_MS = 2_000;
const MARGIN = 0.03; // share of an axis that stays free at each end

/** Bounds of an axis that grow at once and shrink late, so that a moving plot stays readable. */
export class AxisRange {
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

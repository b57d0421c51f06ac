// Live readings as large numbers with unit and extremes.

import { element, fixed, write } from "./format.js";
import { QUANTITIES } from "./quantities.js";

const SHOWN = ["force", "displacement", "velocity", "voltage", "current", "temperature"];
/** Age [s] up to which the newest value of a slow channel is shown. */
const FRESH_S = 2.5;
/** Time between two updates [ms]: five a second are readable without flicker. */
const PERIOD_MS = 200;

export class Readings {
  constructor(ring, place, seconds) {
    Object.assign(this, { ring, seconds, shown: -1 });
    this.rows = SHOWN.map((name) => row(QUANTITIES[name], place));
    setInterval(() => this.write(), PERIOD_MS);
  }

  write() {
    if (this.shown === this.ring.end) return;
    this.shown = this.ring.end;
    for (const { quantity, number, unit, extremes } of this.rows) {
      const { last, low, high } = this.ring.recent(quantity.field, this.seconds, FRESH_S);
      const shown = (value) => fixed(value * quantity.scale, quantity.digits);
      write(number, shown(last));
      write(unit, ` ${quantity.unit}`);
      write(extremes, Number.isNaN(low) ? "no reading" : `${shown(low)} … ${shown(high)}`);
    }
  }
}

function row(quantity, place) {
  const number = element("span", { className: "value" }, "–");
  const unit = element("span", { className: "unit" }, ` ${quantity.unit}`);
  const extremes = element("dd", { className: "extremes" }, "–");
  place.append(element("div", {},
    element("dt", {}, quantity.label), element("dd", { className: "now" }, number, unit), extremes));
  return { quantity, number, unit, extremes };
}

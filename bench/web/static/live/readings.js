// Live readings as large numbers with unit and extremes.

import { element, fixed, write } from "../common/format.js";
import { QUANTITIES } from "../common/quantities.js";

const SHOWN = ["force", "displacement", "velocity", "voltage", "current", "temperature"];
/** Age [s] up to which the newest value of a slow channel is shown. */
const FRESH_S = 2.5;
/** Time between two updates [ms]: five a second are readable without flicker. */
const PERIOD_MS = 200;

export class Readings {
  /** `limits` describe the distance to limits and end stops; without them only values and extremes are shown. */
  constructor(ring, place, seconds, limits = null) {
    Object.assign(this, { ring, seconds, limits, shown: -1 });
    this.rows = SHOWN.map((name) => ({ name, ...row(QUANTITIES[name], place) }));
    this.timer = setInterval(() => this.write(), PERIOD_MS);
  }

  destroy() {
    clearInterval(this.timer);
  }

  write() {
    if (this.shown === this.ring.end) return;
    this.shown = this.ring.end;
    for (const { name, quantity, number, unit, extremes, margins } of this.rows) {
      const { last, low, high } = this.ring.recent(quantity.field, this.seconds, FRESH_S);
      const shown = (value) => fixed(value * quantity.scale, quantity.digits);
      write(number, shown(last));
      write(unit, ` ${quantity.unit}`);
      write(extremes, Number.isNaN(low) ? "no reading" : `${shown(low)} … ${shown(high)}`);
      write(margins, this.limits?.describe(name, this.reach(name, { low, high })).join("\n") ?? "");
    }
  }

  /** Extremes that count for the limits: the bench limits the rod, whose encoder differs slightly from the LVDT. */
  reach(name, extremes) {
    if (name !== "displacement") return extremes;
    const rod = this.ring.recent(QUANTITIES.position.field, this.seconds);
    return Number.isNaN(rod.low) ? extremes : rod;
  }
}

function row(quantity, place) {
  const number = element("span", { className: "value" }, "–");
  const unit = element("span", { className: "unit" }, ` ${quantity.unit}`);
  const extremes = element("dd", { className: "extremes" }, "–");
  const margins = element("dd", { className: "margins" });
  place.append(element("div", {},
    element("dt", {}, quantity.label), element("dd", { className: "now" }, number, unit), extremes, margins));
  return { quantity, number, unit, extremes, margins };
}

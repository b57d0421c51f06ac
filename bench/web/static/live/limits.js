// Limits in force and end stops, and the distance of the readings to them.

import { fixed } from "../common/format.js";
import { QUANTITIES } from "../common/quantities.js";

/** Limited quantity of the bench by displayed quantity; the rod is limited, and the page shows its position. */
const LIMITED = {
  force: "force", displacement: "displacement", velocity: "actuator_velocity", voltage: "coil_voltage",
  current: "coil_current", temperature: "temperature",
};
const ACTIONS = { indicate: "alarm", hold: "hold", controlled_stop: "stop", trip: "trip" };
/** Share of the strictest limit that an axis spans at least, so that noise at rest does not fill it. */
const LEAST_SHARE = 0.2;

export class Limits {
  constructor() {
    this.byQuantity = new Map();
    this.travel = null;
  }

  /** Takes the limits of a status; axes then span at least a share of the strictest one. */
  update({ limits = [], travel_m: travel = null }) {
    if (JSON.stringify([limits, travel]) === this.taken) return;
    this.taken = JSON.stringify([limits, travel]);
    this.travel = travel;
    this.byQuantity = Map.groupBy(limits, ({ quantity }) => quantity);
    for (const name of ["force", "displacement", "velocity"]) {
      const values = this.of(name).map(({ value }) => value);
      if (values.length) QUANTITIES[name].least = LEAST_SHARE * Math.min(...values);
    }
  }

  of(name) {
    return this.byQuantity.get(LIMITED[name]) ?? [];
  }

  /** Lines on the least distance to each limit, and for the displacement to both end stops, for given extremes. */
  describe(name, { low, high }) {
    if (!Number.isFinite(low)) return [];
    const quantity = QUANTITIES[name];
    const shown = (value) => `${fixed(value * quantity.scale, quantity.digits)}\u00a0${quantity.unit}`;
    const reach = Math.max(Math.abs(low), Math.abs(high));
    const lines = this.of(name).map(({ action, value }) => `${ACTIONS[action]} at ${name === "temperature" ? "" : "±"}${shown(value)}: ${shown(value - reach)} left`);
    if (name !== "displacement" || !this.travel) return lines;
    const [bottom, top] = this.travel;
    return [`end stop ${shown(bottom)}: ${shown(low - bottom)} left`, `end stop ${shown(top)}: ${shown(top - high)} left`, ...lines];
  }
}

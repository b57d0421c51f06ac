// Displayed quantities with their units, which each person chooses for this browser.

const KEY = "mrbench.units";
const NEWTONS_PER_LBF = 4.4482216152605;
const METRES_PER_INCH = 0.0254;
/** Units by choice: `scale` from SI to the unit, and digits after the point. */
const CHOICES = {
  force: {
    N: { unit: "N", scale: 1, digits: 1 },
    lbf: { unit: "lbf", scale: 1 / NEWTONS_PER_LBF, digits: 2 },
  },
  length: {
    mm: { displacement: { unit: "mm", scale: 1e3, digits: 2 }, velocity: { unit: "mm/s", scale: 1e3, digits: 1 } },
    in: {
      displacement: { unit: "in", scale: 1 / METRES_PER_INCH, digits: 3 },
      velocity: { unit: "in/s", scale: 1 / METRES_PER_INCH, digits: 2 },
    },
  },
};

/** Returns the chosen units, such as `{ force: "N", length: "mm" }`. */
export function chosenUnits() {
  const stored = JSON.parse(localStorage.getItem(KEY) ?? "{}");
  return { force: stored.force in CHOICES.force ? stored.force : "N", length: stored.length in CHOICES.length ? stored.length : "mm" };
}

/** Describes a quantity; `least` is the smallest span of an axis, in SI. */
function quantity(field, label, unit, digits, least, colour, more = {}) {
  return { field, label, unit, digits, least, colour, scale: 1, hole: 0.1, ...more };
}

/** Displayed quantities. `hole` is the time [s] without values after which a trace is interrupted. */
export const QUANTITIES = {
  force: quantity("force", "Force", "N", 1, 20, "--force"),
  displacement: quantity("displacement", "Displacement", "mm", 2, 2e-3, "--displacement"),
  velocity: quantity("velocity", "Velocity", "mm/s", 1, 20e-3, "--velocity"),
  position: quantity("actuator_position", "Position of the rod", "mm", 2, 2e-3, "--displacement"),
  drive: quantity("coil_drive", "Drive", "V", 3, 0.1, "--drive"),
  voltage: quantity("coil_voltage", "Coil voltage", "V", 3, 0.1, "--drive"),
  current: quantity("coil_current", "Coil current", "A", 3, 0.1, "--drive"),
  // Sampled slowly, so that its trace has long holes.
  temperature: quantity("temperature", "Temperature", "°C", 1, 2, "--temperature", { hole: 2.5 }),
};
export const FIELDS = Object.values(QUANTITIES).map((one) => one.field);

/** Applies units to the displayed quantities and keeps the choice in this browser. */
export function chooseUnits(units) {
  localStorage.setItem(KEY, JSON.stringify({ ...chosenUnits(), ...units }));
  applyUnits();
}

function applyUnits() {
  const { force, length } = chosenUnits();
  Object.assign(QUANTITIES.force, CHOICES.force[force]);
  for (const name of ["displacement", "velocity"]) Object.assign(QUANTITIES[name], CHOICES.length[length][name]);
  Object.assign(QUANTITIES.position, CHOICES.length[length].displacement);
}

applyUnits();

// Form of a method: units of its keys, and a first method to begin with.

import { get } from "../common/api.js";
import { describeDriveKind } from "../common/format.js";
import { QUANTITIES } from "../common/quantities.js";
import { SchemaForm } from "./schema_form.js";

const plain = (unit) => ({ unit, scale: 1 });
const CHOSEN = { m: "displacement", "m/s": "velocity", N: "force" };

/** A short method to begin with; its limits are those of a small damper. */
export const makeFirstMethod = () => ({
  schema: "mrbench.method/1", name: "new_method", title: "Three drives on a sine", description: "", rate_hz: 1000, drive_kind: "coil_v",
  limits: { stroke_m: 0.02, velocity_mps: 0.3, acceleration_mps2: 6, force_n: 1500, drive: 0.5 },
  segments: [{
    name: "10mm_1Hz", motion: { kind: "sine", amplitude_m: 0.01, frequency_hz: 1 }, cycles: 6,
    drive: { kind: "staircase", levels: [0, 0.25, 0.5] },
  }],
});

/** Makes the form from the description of the REST interface, so that it has every key of the service. */
export async function makeMethodForm(onChange) {
  const { components: { schemas } } = await get("openapi.json");
  const form = new SchemaForm(schemas, { onChange, nameOf: describeDriveKind, unitOf: (unit) => findUnit(unit, form.document.drive_kind) });
  return { form, schema: schemas.Method };
}

function findUnit(unit, driveKind) {
  if (unit in CHOSEN) return QUANTITIES[CHOSEN[unit]];
  if (unit === "V or A") return plain(driveKind === "coil_a" ? "A" : "V");
  return plain(unit === "1" ? "" : unit);
}

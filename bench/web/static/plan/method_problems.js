// The field of a method that a message of the service is about.

/** Words of a message about a whole segment, and the keys that are to be changed then. */
const CLUES = [
  [/corner_acceleration_mps2/, ["motion.corner_acceleration_mps2"]],
  [/rate_hz|samples per cycle/, ["/rate_hz"]],
  [/the shunt needs/, ["shunt"]],
  [/at its first position/, ["motion.displacement_m"]],
  [/steps at phases/, ["drive.phase_cycles"]],
  [/give duration_s|fewer than 2 samples|make it longer/, ["duration_s", "cycles"]],
  [/cycles/, ["cycles", "duration_s"]],
  [/displacement|velocity|acceleration/, ["motion.amplitude_m", "motion.displacement_m", "motion.end_m", "motion.spectrum"]],
  [/\bdrive\b|time_s/, ["drive.value", "drive.levels", "drive.values", "drive.end", "drive.high"]],
];
/** Places in a document as a message names them; the kind of a motion or drive stands in between. */
const POSITION = /(?:^|[ .])((?:schema|name|title|description|rate_hz|drive_kind|limits|conditioning|segments)(?:\.\w+)*)(?: \([^)]*\))?: (.+)$/;

/** Returns path and text of a message; the path is empty if it is about the method as a whole. */
export function locateProblem(message, method) {
  const [, position, text] = POSITION.exec(message) ?? [];
  if (position) return { path: readPath(position, method), text };
  const segments = method.segments ?? [];
  const [, name] = /segment ([^\s,:]+)/.exec(message) ?? [];
  // Each level of a staircase is a segment of its own, named after the planned one.
  const exact = segments.findIndex((one) => name === one.name);
  const index = exact < 0 ? segments.findIndex((one) => name?.startsWith(`${one.name}_`)) : exact;
  return { path: index < 0 ? [] : findKey(message, ["segments", index], segments[index]), text: message };
}

/** Steps of a position; the kind of a union, which is no key, is left out. */
function readPath(position, method) {
  const path = [];
  let value = method;
  for (const step of position.split(".")) {
    if (value && typeof value === "object" && value.kind === step && !(step in value)) continue;
    path.push(/^\d+$/.test(step) ? Number(step) : step);
    value = value?.[step];
  }
  return path;
}

function findKey(message, path, segment) {
  const keys = CLUES.find(([words]) => words.test(message))?.[1] ?? [];
  for (const key of keys) {
    if (key.startsWith("/")) return [key.slice(1)];
    const steps = key.split(".");
    const value = steps.reduce((owner, step) => owner?.[step], segment);
    if (value !== undefined && value !== null) return [...path, ...steps];
  }
  return path;
}

// Formatting of numbers and times with their units, and creation of elements.

/** Formats a number with fixed digits and a true minus sign; a dash for a missing number. */
export function fixed(value, digits) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const text = value.toFixed(digits);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

/** Formats a number with significant digits and a true minus sign, in exponents only where they are needed. */
export function significant(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  const text = size && (size >= 1e6 || size < 1e-3) ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
  return text.replaceAll("-", "−").replace("e+", "e");
}

/** Returns the unit that suits the size of a quantity in SI, and the factor to it: small lengths in mm or µm, short times in ms. */
export function suitUnit(unit, size) {
  if (unit === "m" && Math.abs(size) < 1) return Math.abs(size) < 1e-3 ? ["µm", 1e6] : ["mm", 1e3];
  return unit === "s" && Math.abs(size) < 1 ? ["ms", 1e3] : [unit, 1];
}

/** Writes a name of a document, such as `seal_friction`, with spaces. */
export const spaced = (name) => name.replaceAll("_", " ");

/** Writes a line of a command as a sentence; a coordinate at its beginning, such as `k0` or `rho`, keeps its case. */
export const sentence = (line) => `${line.replace(/^(?!(eta|rho) )[a-z](?=[a-z]+ )/, (letter) => letter.toUpperCase())}.`;

/** Formats a duration [s]: `42 s`, `2 min 14 s`, `1 h 05 min`. */
export function duration(seconds) {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return "–";
  const whole = Math.max(0, Math.round(seconds));
  if (whole < 60) return `${whole} s`;
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${pad(whole % 60)} s`;
  return `${Math.floor(whole / 3600)} h ${pad(Math.floor((whole % 3600) / 60))} min`;
}

/** Formats a short time [s] in a suitable unit. */
export function shortTime(seconds) {
  if (seconds === null || seconds === undefined) return "–";
  const size = Math.abs(seconds);
  if (size < 1e-3) return `${fixed(seconds * 1e6, 0)} µs`;
  if (size < 1) return `${fixed(seconds * 1e3, size < 0.01 ? 2 : 0)} ms`;
  return size < 60 ? `${fixed(seconds, 1)} s` : duration(seconds);
}

/** Formats an ISO 8601 instant as local date and time with its zone: `2025-03-04 10:13:30 UTC+01:00`. */
export function instant(text) {
  const date = new Date(text);
  return localTime(text) === "–" ? "–" : `${localTime(text)} ${zone(date)}`;
}

/** Formats an ISO 8601 instant as local date and time, for a place that names the zone elsewhere. */
export function localTime(text) {
  const date = new Date(text);
  if (!text || Number.isNaN(date.getTime())) return "–";
  return `${date.getFullYear()}-${pad(date.getMonth() + 1)}-${pad(date.getDate())} ${clock(date)}`;
}

/** Offset of local time from UTC at a date: `UTC+01:00`, or `UTC`. */
export function zone(date = new Date()) {
  const minutes = -date.getTimezoneOffset();
  if (!minutes) return "UTC";
  const size = Math.abs(minutes);
  return `UTC${minutes > 0 ? "+" : "−"}${pad(Math.floor(size / 60))}:${pad(size % 60)}`;
}

export const clock = (date) => [date.getHours(), date.getMinutes(), date.getSeconds()].map(pad).join(":");

const pad = (number) => String(number).padStart(2, "0");

const DRIVES = {
  coil_v: "coil voltage",
  coil_a: "coil current",
  driver_command_v: "driver command",
};

/** Returns the name of a drive kind. */
export const describeDriveKind = (kind) => DRIVES[kind] ?? kind ?? "";

/** Creates an element with properties and children; text is never interpreted as HTML. */
export function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name in made) made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

/** Writes a text only if it differs, so that a screen reader does not repeat it. */
export function write(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

export const byId = (id) => document.getElementById(id);

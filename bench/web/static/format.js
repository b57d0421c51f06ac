// Numbers, times and small pieces of the page, each quantity with its unit.

/** A number with fixed digits and a true minus sign; a dash where there is none. */
export function fixed(value, digits) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const text = value.toFixed(digits);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}

/** A length of time [s] in words: `42 s`, `2 min 14 s`, `1 h 05 min`. */
export function duration(seconds) {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return "–";
  const whole = Math.max(0, Math.round(seconds));
  if (whole < 60) return `${whole} s`;
  if (whole < 3600) return `${Math.floor(whole / 60)} min ${pad(whole % 60)} s`;
  return `${Math.floor(whole / 3600)} h ${pad(Math.floor((whole % 3600) / 60))} min`;
}

/** A short time [s] in the unit that suits it. */
export function shortTime(seconds) {
  if (seconds === null || seconds === undefined) return "–";
  const size = Math.abs(seconds);
  if (size < 1e-3) return `${fixed(seconds * 1e6, 0)} µs`;
  if (size < 1) return `${fixed(seconds * 1e3, size < 0.01 ? 2 : 0)} ms`;
  return size < 60 ? `${fixed(seconds, 1)} s` : duration(seconds);
}

/** Local date and time of an ISO 8601 instant. */
export function instant(text) {
  const date = new Date(text);
  if (!text || Number.isNaN(date.getTime())) return "–";
  return `${date.getFullYear()}-${pad(date.getMonth() + 1)}-${pad(date.getDate())} ${clock(date)}`;
}

export const clock = (date) => [date.getHours(), date.getMinutes(), date.getSeconds()].map(pad).join(":");

const pad = (number) => String(number).padStart(2, "0");

const DRIVES = {
  coil_v: "coil voltage",
  coil_a: "coil current",
  driver_command_v: "driver command",
};

/** A kind of drive in words. */
export const driveWords = (kind) => DRIVES[kind] ?? kind ?? "";

/** An element with properties and children; text stays text, whatever it holds. */
export function element(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name in made) made[name] = value;
    else made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

/** Writes a text only where it differs, so that a screen reader is not told the same thing again. */
export function write(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

export const byId = (id) => document.getElementById(id);

// Forecast of a run by its dry run: peaks beside the limits, heat, disk, and what the strokes can identify.

import { post } from "../common/api.js";
import { withBench } from "../common/bench.js";
import { duration, element, sentence, significant } from "../common/format.js";
import { QUANTITIES } from "../common/quantities.js";
import { rowTable } from "../common/tables.js";

/** Time [ms] that the assessment of the strokes may take. */
const ASSESSMENT_MS = 300_000;
/** Actions of the bench that end a motion. */
const ENDING_ACTIONS = ["hold", "controlled_stop", "trip"];
const PLAIN = (unit) => ({ unit, scale: 1 });
/** Rows of the table: name, quantity, and the fields of the peak, of the method's limit and of the bench's limit. */
const ROWS = [
  ["Displacement", () => QUANTITIES.displacement, "displacement_m", "stroke_m", "displacement"],
  ["Velocity", () => QUANTITIES.velocity, "velocity_mps", "velocity_mps", "actuator_velocity"],
  ["Acceleration", () => PLAIN("m/s²"), "acceleration_mps2", "acceleration_mps2", null],
  ["Force, at most", () => QUANTITIES.force, "force_n", "force_n", "force"],
  ["Drive", (unit) => PLAIN(unit), "drive", "drive", null],
];

/** Returns a section that fills with the forecast of a method; nothing moves. */
export function makeForecast(method) {
  const numbers = element("div", {}, element("p", { className: "soft" }, "Computing …"));
  const words = element("ul", { className: "words" }, element("li", { className: "soft" }, "Assessing the strokes, for some seconds …"));
  const section = element("section", { className: "forecast", "aria-label": "Forecast" },
    element("h3", {}, "Forecast"), numbers, element("h3", {}, "What the strokes can identify"), words);
  fill(method, section, numbers, words);
  return section;
}

/** Returns sentences on what the strokes of a method can identify; the method is a name or a document. */
export async function assess(method) {
  const { envelope, identifiability_error: error } = await post("methods/dry-run", withBench({ method }), ASSESSMENT_MS);
  return envelope.design?.messages.map(sentence) ?? [`Not known: ${error}`];
}

async function fill(method, section, numbers, words) {
  try {
    const forecast = await post("methods/dry-run", withBench({ method, identifiability: false }));
    numbers.replaceChildren(...describeNumbers(forecast));
    if (!section.isConnected) return; // another method was chosen meanwhile
    words.replaceChildren(...(await assess(method)).map((line) => element("li", {}, line)));
  } catch (problem) {
    words.replaceChildren(element("li", { className: "problem" }, problem.after("There is no forecast")));
  }
}

/** Peaks beside the limits, heat and disk of a dry run, with the obstacles on this bench. */
export function describeNumbers({ envelope, bench, mean_heat_w: flow }) {
  const obstacles = bench.unknown ? [`Limits of the bench are not known: ${bench.unknown}`] : bench.obstacles;
  return [
    element("ul", { className: "warnings", "aria-label": "Obstacles" }, ...obstacles.map((text) => element("li", {}, text))),
    makeTable(envelope, bench.limits),
    element("p", {}, `Duration ${duration(envelope.total.duration_s)}. Heat in the damper at most ${significant(envelope.heat_j, 3)} J, `
      + `${significant(flow, 3)} W on average. ${describeDisk(bench)}`),
    element("p", { className: "soft" }, `The force is the largest one of the damper “${envelope.damper}”: ${envelope.verdict}.`),
  ];
}

function describeDisk({ log_bytes: needed, free_bytes: free }) {
  if (needed === null) return "";
  const room = free === null ? "" : `; the disk has ${significant(free / 1e9, 3)} GB free`;
  return `The log needs up to ${significant(needed / 1e6, 3)} MB${room}.`;
}

function makeTable({ total, limits, drive_unit: unit }, fixture) {
  const rows = ROWS.map(([name, quantity, peak, limit, key]) => {
    const { scale, unit: shown } = quantity(unit);
    const of = (value) => (value === null ? "–" : `${significant(value * scale)} ${shown}`);
    const values = [total[peak], limits[limit], findEnd(fixture[key])];
    return element("tr", {}, element("th", { scope: "row" }, name), ...values.map((value) => element("td", { className: "number right" }, of(value))));
  });
  const heads = ["Quantity", "Peak", "Limit of the method", "Limit of the bench"].map((text, k) =>
    element("th", { scope: "col", className: k ? "right" : "" }, text));
  return rowTable("Peaks and limits", heads, rows);
}

/** Lowest value at which the bench ends a motion; null without one. */
function findEnd(limit) {
  const values = limit ? ENDING_ACTIONS.map((action) => limit[action]).filter((value) => value !== null) : [];
  return values.length ? Math.min(...values) : null;
}

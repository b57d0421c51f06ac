// Letter, colour, line and marker of each run of a comparison. Each of the three tells runs apart without the others.

import { element, localTime } from "../common/format.js";

const SVG = "http://www.w3.org/2000/svg";
const COLOURS = 6;
const DASHES = [[], [9, 4], [2, 3], [10, 3, 2, 3]];
/** Corners of the markers around their middle, with radius 1. */
const MARKERS = [polygon(16, 0), polygon(4, Math.PI / 4), polygon(3, -Math.PI / 2), polygon(4, 0), polygon(3, Math.PI / 2)];

function polygon(count, turn) {
  const angles = Array.from({ length: count }, (_, k) => turn + (2 * Math.PI * k) / count);
  return angles.map((angle) => [Math.cos(angle), Math.sin(angle)]);
}

/** Letter of a run by its place in the comparison: A is the first run. */
export const letter = (place) => String.fromCharCode(65 + place);

/** Name of a run in words: letter, specimen, method and start in local time. */
export const describeRun = (run, place) => `${letter(place)}: ${run.specimen || "unnamed"}, ${run.method}, ${localTime(run.started)}`;

/** Colour of the style sheet, dashes [px] and marker of a run; the combination is different for each of 20 runs. */
export function runStyle(place) {
  return {
    colour: `--run-${place % COLOURS}`,
    dash: DASHES[(place + Math.floor(place / COLOURS)) % DASHES.length],
    marker: MARKERS[place % MARKERS.length],
  };
}

/** Line with marker of a run, as in the plots. */
export function makeSwatch(place) {
  const { colour, dash, marker } = runStyle(place);
  const draw = (tag, attributes) => {
    const made = document.createElementNS(SVG, tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    return made;
  };
  const swatch = draw("svg", { viewBox: "0 0 48 14", width: 48, height: 14, class: "swatch", "aria-hidden": "true" });
  swatch.style.color = `var(${colour})`;
  const corners = marker.map(([x, y]) => `${24 + 5 * x},${7 + 5 * y}`).join(" ");
  swatch.append(
    draw("path", { d: "M0 7H48", stroke: "currentColor", "stroke-width": 2, "stroke-dasharray": dash.join(" ") }),
    draw("polygon", { points: corners, fill: "currentColor" }));
  return swatch;
}

/** Legend of the runs of a comparison. */
export function makeLegend(runs) {
  return element("ul", { className: "legend", "aria-label": "Legend" },
    ...runs.map((run, place) => element("li", {}, makeSwatch(place), describeRun(run, place))));
}

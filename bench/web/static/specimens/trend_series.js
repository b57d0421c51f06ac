// Series of a specimen: quantities of its trend, and parameters of the fits of its runs.

import { spaced } from "../common/format.js";

const FORMER_DIRECTIONS = { grows: "rising", falls: "falling" };
const DAY_MS = 86_400_000;

/** Reads the changes of a trend; documents of earlier versions have other names. */
export const readChanges = (trend) => trend.changes.map(({ way, per_run: slope, sizes, ...change }) => ({
  direction: FORMER_DIRECTIONS[way] ?? way, change_per_run: slope, values: sizes, ...change,
}));

/** Name of a quantity for a person: `gas spring, preload`. */
export const describeQuantity = (name) => spaced(name).replace(".", ", ");

/** Returns all series: those of the trend first, then those of the fits. */
export function listSeries(trend, parameters, runs) {
  return [...(trend ? listTrendSeries(trend, runs) : []), ...listFitSeries(parameters)];
}

function listTrendSeries(trend, runs) {
  const byLog = new Map(runs.map((run) => [run.log.split(/[\\/]/).at(-1), run]));
  return readChanges(trend).map(({ quantity, unit, since, values }) => {
    const points = values.map(({ log, value, ci95 }, k) => ({ number: k + 1, name: log, run: byLog.get(log), value, ci95 }));
    const first = since ? points.findIndex(({ name }) => name === since) : -1;
    return { key: quantity, source: "trend", unit, points: withTimes(points), start: first > 0 ? first - 1 : null };
  });
}

function listFitSeries(parameters) {
  const names = [...new Set(parameters.flatMap((one) => Object.keys(one.parameters)))];
  return names.map((name) => {
    const found = parameters.filter((one) => name in one.parameters);
    const points = found.map(({ run, started, parameters: { [name]: { value, ci95 } } }, k) => ({
      number: k + 1, name: run, run: { id: run, started }, value, ci95,
    }));
    return { key: `fit.${name}`, source: "fit", unit: found.at(-1).parameters[name].unit, points: withTimes(points), start: null };
  });
}

/** Adds the time since the first run [days]; null where the run is no longer in the catalogue. */
function withTimes(points) {
  const times = points.map(({ run }) => (run ? new Date(run.started).getTime() : null));
  const first = times.find((time) => time !== null);
  return points.map((point, k) => ({ ...point, days: times[k] === null ? null : (times[k] - first) / DAY_MS }));
}

/** Points over the number of the run or over time, for a line: `{ x, value, ci95 }`, and the place of the change. */
export function placePoints({ points, start }, over) {
  const field = over === "time" ? "days" : "number";
  const placed = points.map((point) => ({ ...point, x: point[field] })).filter(({ x }) => x !== null);
  return { placed, change: start === null ? undefined : points[start][field] ?? undefined };
}

// Table of a batch: state and answer of the job of each run, with force errors in the chosen unit.

import { keep } from "../common/refresh.js";
import { element, instant, localTime, significant, spaced, zone } from "../common/format.js";
import { QUANTITIES } from "../common/quantities.js";
import { runAddress } from "../common/router.js";
import { table } from "../common/tables.js";
import { inForceUnit, percent } from "../runs/fit_tables.js";
import { describeVerdict } from "../runs/run_facts.js";

const NOUNS = { identify: "Identification", diagnose: "Diagnosis" };
const MARKS = { done: "good", cancelled: "fair", failed: "bad", refused: "bad" };

/** What was requested, and how many jobs have not ended. */
export function describeBatch({ kind, created, rows, unfinished }) {
  const left = unfinished ? `${unfinished} of ${rows.length} not ended yet` : "all have ended";
  return `${NOUNS[kind] ?? spaced(kind)} of ${rows.length} ${rows.length === 1 ? "run" : "runs"}, requested ${instant(created)}: ${left}.`;
}

/** Table with a row for each run, in the order of the request. */
export function makeBatchTable({ kind, rows }) {
  const { unit } = QUANTITIES.force;
  const [heads, fill] = kind === "diagnose"
    ? [["Answer", "Probability", `Law alone [${unit}]`, `With effects [${unit}]`, "Gap closed"], fillDiagnosis]
    : [["Result", `RMSE [${unit}]`, `Noise floor [${unit}]`, "RMSE / noise floor"], fillFit];
  return table(`Results by run; times are ${zone()}`, ["Run", "Specimen, method", "Job", ...heads],
    rows.map((row) => [linkRun(row), [row.specimen || "unnamed", small(row.method)], describeState(row), ...fill(row)]));
}

const fillDiagnosis = (row) => [
  row.verdict ? describeVerdict(row) : "–", percent(row.probability), inForceUnit(row.before_n), inForceUnit(row.after_n), percent(row.shrinkage),
];

const fillFit = ({ result, rmse_n: rmse, noise_floor_n: floor }) => [
  result || "–", inForceUnit(rmse), inForceUnit(floor), rmse !== null && floor > 0 ? significant(rmse / floor, 3) : "–",
];

/** Link to a run; one that is not in the catalogue has only its id. */
function linkRun({ run, started }) {
  if (!started) return [run];
  return [keep(element("a", { href: runAddress(run) }, localTime(started)), run)];
}

/** State of a job as a mark, with the reason of a failure or refusal. */
const describeState = ({ state, error }) => [element("span", { className: `mark ${MARKS[state] ?? "plain"}` }, state), small(error)];

const small = (text) => element("small", {}, text);

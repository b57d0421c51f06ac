// Facts on a run in words: outcome, fit, diagnosis and jobs.

import { element, fixed, spaced } from "../common/format.js";

const OUTCOMES = { clean: "good", lossy: "fair", truncated: "fair", incomplete: "bad" };
const UNFINISHED = ["queued", "running"];
const VERDICTS = {
  no_gap: "no gap", explained: "explained", partly_explained: "partly explained", unexplained: "unexplained",
};
const CUT_OFF = "The recording was cut off. Repair keeps what was recorded.";

export const hasEnded = (run) => Boolean(run.outcome);
export const isUnfinished = (job) => UNFINISHED.includes(job.state);
export const mayRetry = (job) => ["failed", "cancelled"].includes(job.state);
export const canResume = (run) => run.source === "run" && hasEnded(run) && run.ending !== "completed";
export const isFitted = (run) => Boolean(findDone(run, "identify"));
/** Newest job of a kind that is done; undefined without one. */
export const findDone = (run, kind) => run.jobs.findLast((job) => job.kind === kind && job.state === "done");
/** True if a report is stored; another one is made at its request, for any complete log. */
export const hasReport = (run) => run.jobs.some((job) => job.state === "done");
export const mayReport = (run) => hasReport(run) || Boolean(run.log_sha256);

/** Outcome of the log as a mark, with its reason below. */
export function describeOutcome(run) {
  const name = run.outcome ?? run.state;
  const ending = run.ending && run.ending !== "completed" ? `, ${run.ending}` : "";
  const mark = element("span", { className: `mark ${OUTCOMES[name] ?? "plain"}` }, spaced(name) + ending);
  const reason = run.state === "truncated" ? CUT_OFF : run.reason;
  const alarms = (run.alarms ?? []).map((text) => element("small", { className: "attention" }, `Alarm: ${text}`));
  const marks = [...(run.calibration_overdue ?? []), ...(run.failed_checks ?? [])].map((text) => element("small", { className: "attention" }, text));
  return [mark, element("small", {}, reason ?? ""), ...alarms, ...marks];
}

/** Force error of the newest fit beside the noise floor. */
export function describeFit(run) {
  const { rmse_n: rmse, noise_floor_n: floor } = run;
  if (!isFitted(run)) return ["–"];
  const ratio = floor > 0 ? `${fixed(rmse / floor, 2)} times the noise floor` : "noise floor not known";
  const result = run.result.replace(/^converged(; )?/, "");
  const words = result.includes(ratio) ? result : [ratio, result].filter(Boolean).join("; ");
  return [element("span", { className: "number" }, `${newtons(rmse)} / ${newtons(floor)}`), element("small", {}, words)];
}

/** Sentence that says why a run has no result of a kind of job, and what to do. */
export function describeMissing(run, kind) {
  const [noun, button] = { identify: ["fit", "Identify"], diagnose: ["diagnosis", "Diagnose"] }[kind];
  const newest = run.jobs.findLast((job) => job.kind === kind);
  if (run.state === "running") return `The run is in progress; its ${noun} follows after its end.`;
  if (run.state === "truncated") return `No ${noun}: the log has no end. Repair log keeps what was recorded.`;
  if (run.trashed) return `No ${noun}: the run is in the trash.`;
  if (newest && isUnfinished(newest)) return `No ${noun} yet: ${describeJob(newest)}.`;
  if (newest) return `No ${noun}: ${describeJob(newest)}. ${button} requests it again.`;
  if (kind === "diagnose" && !isFitted(run)) return "No diagnosis: it follows the fit.";
  return `No ${noun} yet: ${button} requests one.`;
}

/** Verdict of a diagnosis with its effects, such as `explained: gas spring`. */
export function describeVerdict({ verdict, effects }) {
  return [VERDICTS[verdict] ?? verdict, effects.map((name) => spaced(name)).join(", ")].filter(Boolean).join(": ");
}

/** State of a job in one line: kind, state, activity or error. */
export function describeJob(job) {
  const share = job.state === "running" && job.fraction ? `${fixed(100 * job.fraction, 0)} %` : "";
  const place = job.position ? `number ${job.position} in the queue` : "";
  const activity = job.state === "running" ? job.activity : "";
  return [`${job.kind} ${job.state}`, place || share || activity, share && activity, job.error].filter(Boolean).join(": ");
}

const newtons = (force) => (force === null ? "–" : `${fixed(force, 2)}\u00a0N`);

// What has changed in a result since the one of another version of mrbench: answer, effects, parameters.

import { get } from "../common/api.js";
import { element, significant, spaced } from "../common/format.js";
import { table } from "../common/tables.js";
import { findDone } from "./run_facts.js";

/** Requests the changes of the newest result of a kind; null without a result of another version. */
export async function loadChanges(run, kind) {
  const newest = findDone(run, kind);
  const isOther = (job) => job.kind === kind && job.state === "done" && job.version !== newest.version;
  if (!newest || !run.jobs.some(isOther)) return null;
  try {
    return await get(`jobs/${encodeURIComponent(newest.id)}/changes`);
  } catch (problem) {
    return { problem };
  }
}

/** Shows changes as elements under a title such as `Fit`; none without changes. */
export function makeChanges(name, changes) {
  if (!changes) return [];
  const heading = (words) => element("h3", {}, `${name}: ${words}`);
  if (changes.problem) return [heading("changes"), paragraph(changes.problem.after("The changes cannot be shown"))];
  const changed = changes.parameters.filter((one) => one.changed);
  return [
    heading(`changes since version ${changes.older_version || "of an earlier time"}`),
    ...describeAnswer(changes).map(paragraph), paragraph(countParameters(changes.parameters, changed)),
    ...(changed.length ? [makeParameterChanges(name, changed)] : []),
  ];
}

function describeAnswer({ older_answer: older, newer_answer: newer, answer_changed: isChanged, effects_added: added, effects_removed: removed }) {
  const list = (words, names) => (names.length ? [`${words}: ${names.map(spaced).join(", ")}.`] : []);
  const answer = isChanged ? `The answer was “${spaced(older)}” and is “${spaced(newer)}”.` : `The answer is the same: ${spaced(newer)}.`;
  return [answer, ...list("Effects named only now", added), ...list("Effects named only before", removed)];
}

function countParameters({ length }, { length: changed }) {
  if (!length) return "No parameter has a 95 % interval in both results.";
  if (!changed) return `All parameters with a 95 % interval agree (${length}).`;
  return `${changed} of ${length} parameters differ: each value is outside the 95 % interval of the other.`;
}

function makeParameterChanges(name, changed) {
  const value = (number, [low, high]) => [significant(number), element("small", {}, `${significant(low)} … ${significant(high)}`)];
  const rows = changed.map((one) => [
    spaced(one.name), value(one.older, one.older_ci95), value(one.newer, one.newer_ci95), one.unit === "1" ? "–" : one.unit,
  ]);
  return table(`${name}: parameters that differ, with 95 % intervals`, ["Parameter", "Before", "Now", "Unit"], rows);
}

const paragraph = (text) => element("p", {}, text);

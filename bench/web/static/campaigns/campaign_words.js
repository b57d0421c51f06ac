// Campaigns in words: states with their marks, steps, drives and cells.

import { element, spaced } from "../common/format.js";

const ENDED = ["done", "stopped"];
const STATUSES = { running: "good", pausing: "fair", paused: "fair", stopping: "fair", done: "good", stopped: "bad" };
const PHASES = {
  starting: "a run or setup step is about to begin", stroking: "a run is in progress",
  preparing: "a setup step is in progress", evaluating: "results are awaited",
  resting: "at rest", asking: "waits for a person",
};
const KINDS = {
  run: "run", rest: "rest", warm_up: "warm-up", repeat: "repeated run", next_stroke: "proposed strokes", prompt: "prompt",
  setup: "setup step",
};

export const hasEnded = ({ status }) => ENDED.includes(status);
export const campaignAddress = (id) => `#/campaigns/${encodeURIComponent(id)}`;
export const describePhase = (phase) => PHASES[phase] ?? "";
export const describeKind = (kind) => KINDS[kind] ?? spaced(kind);

/** State of a campaign as a mark: a shape, and the word. */
export const markStatus = ({ status }) => element("span", { className: `mark ${STATUSES[status] ?? "plain"}` }, status);

/** State of a step as a mark: each state has a shape of its own. */
export const markStep = (state) => element("span", { className: "step-state", "data-state": state }, spaced(state));

/** Constant drive of a run with its unit. */
export const describeDrive = (drive, unit) => (drive === null ? "the method's own drive" : `drive ${drive} ${unit}`);

/** Counts states: `3 done, 2 pending`. */
export function countStates(states) {
  const counts = new Map();
  for (const state of states) counts.set(state, (counts.get(state) ?? 0) + 1);
  return [...counts].map(([state, count]) => `${count} ${spaced(state)}`).join(", ");
}

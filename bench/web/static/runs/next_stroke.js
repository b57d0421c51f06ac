// The stroke that a diagnosis proposes: in words, and as a run of the same method with this stroke at its end.

import { get, post, start } from "../common/api.js";
import { withBench } from "../common/bench.js";
import { ask } from "../common/dialogs.js";
import { forceText, inForceUnit } from "./fit_tables.js";
import { byId, duration, element, significant, write } from "../common/format.js";
import { QUANTITIES } from "../common/quantities.js";
import { need } from "../common/rights.js";
import { joinEffects } from "./run_diagnosis.js";
import { operatorName } from "../common/session.js";

const SUFFIX = "_extended";

/** Describes a segment of a method: motion, drive and cycles with their units. */
export function describeStroke({ motion, drive, cycles }, driveUnit) {
  const { scale, unit } = QUANTITIES.displacement;
  const sizes = [
    "amplitude_m" in motion ? `${significant(motion.amplitude_m * scale, 3)} ${unit}` : "",
    "frequency_hz" in motion ? `${significant(motion.frequency_hz, 3)} Hz` : "",
  ].filter(Boolean).join(", ");
  const level = "value" in drive
    ? `at ${significant(drive.value, 3)} ${driveUnit}` : `with the drive levels ${(drive.levels ?? []).map((one) => significant(one, 3)).join(", ")} ${driveUnit}`;
  return `${motion.kind}${sizes && ` of ${sizes}`}, ${cycles ? `${cycles} cycles ` : ""}${level}`;
}

/** Returns a method with a stroke at its end, under the name of the method and `_extended`. */
export function extendMethod(method, segment) {
  const names = new Set(method.segments.map(({ name }) => name));
  let number = 1;
  while (names.has(`next_stroke_${number}`)) number += 1;
  const name = method.name.endsWith(SUFFIX) ? method.name : method.name + SUFFIX;
  const title = method.name === name ? method.title : `${method.title}, with a proposed stroke`;
  return { ...method, name, title, segments: [...method.segments, { ...segment, name: `next_stroke_${number}` }] };
}

/** Section content: the proposal in words, its Start button, and the answer of the service. */
export function makeNextStroke(run, { next_stroke: proposal }, driveUnit) {
  const text = describeStroke(proposal.segment, driveUnit);
  const sets = proposal.separates.map((names) => `“${joinEffects(names)}”`).join(" and ");
  const answer = element("p", { className: "note", role: "status" });
  const button = need("operate manage_methods", element("button", { type: "button", className: "primary" }, "Start with this stroke …"));
  button.addEventListener("click", async () => {
    button.disabled = true;
    await offer(run, proposal.segment, text, answer);
    button.disabled = false;
  });
  return [
    element("p", {}, element("strong", {}, `Proposed next stroke: ${text}.`)),
    element("p", {}, `It separates ${sets}: their forces differ there by ${inForceUnit(proposal.expected_n)} ${QUANTITIES.force.unit} (RMS). `
      + `Detectability ${significant(proposal.detectability, 2)}: the part that no refit removes, over noise and form error, times the root of the number of samples.`),
    element("p", { className: "actions" }, button), answer,
  ];
}

/** Asks whether the method with the stroke is to be started, and starts it; a refusal is shown with its reason. */
async function offer(run, segment, text, answer) {
  try {
    write(answer, "Checking the method with this stroke …");
    const method = extendMethod(await findMethod(run), segment);
    const forecast = await post("methods/dry-run", withBench({ method, identifiability: false }));
    write(answer, "");
    if (!(await ask({ title: "Start with this stroke?", texts: describeStart(run, method, text, forecast), action: "Start" }))) return;
    write(answer, "Starting …");
    await startMethod(run, method);
  } catch (problem) {
    write(answer, problem.after("Not started"));
  }
}

/** Method of a run in the version that it had; its newest one if the version is not known. */
function findMethod({ method, method_version: version }) {
  return get(`methods/${encodeURIComponent(method)}${version ? `/${version}` : ""}`);
}

function describeStart(run, method, text, { envelope, bench }) {
  const version = run.method_version ? `version ${run.method_version}` : "the newest version, because that of this run is not known";
  const { total } = envelope;
  return [
    `The rod moves: the specimen ${run.specimen || "of the bench"} has to be clamped, and no person may be within its reach.`,
    `Method ${run.method} (${version}), and at its end: ${text}. It is stored as ${method.name}.`,
    `It takes ${duration(total.duration_s)}. Force at most ${forceText(total.force_n)} by the damper “${envelope.damper}”.`,
    ...(bench.unknown ? [`Limits of the bench are not known: ${bench.unknown}`] : bench.obstacles.map((one) => `Obstacle: ${one}.`)),
  ];
}

async function startMethod(run, method) {
  const { name, version } = await post("methods", method);
  const operator = operatorName();
  await start("runs", withBench({ method: name, method_version: version, operator, ...(run.specimen && { specimen: run.specimen }) }));
  // The next key can stop a run that was started here. The router moves the focus to the title of the view before.
  addEventListener("hashchange", () => byId("stop").focus(), { once: true });
  location.hash = "#/bench";
}

// Start of a campaign from its document: pasted or from a file; the dry run is shown before it can be started.

import { post, start } from "../common/api.js";
import { withBench } from "../common/bench.js";
import { describeDrive, describeKind } from "./campaign_words.js";
import { duration, element, sentence, significant, write, byId } from "../common/format.js";
import { QUANTITIES } from "../common/quantities.js";
import { followOperator } from "../common/session.js";
import { factList, table } from "../common/tables.js";

const PLAN_TIMEOUT_MS = 120_000;
/** Time [ms] that the assessment of all methods may take. */
const ASSESSMENT_MS = 600_000;
const TEST_TIMEOUT_MS = 30_000;
/** Largest number of steps of a dry run that are listed. */
const MAX_STEPS = 100;

export class CampaignStart {
  /** Takes a function that receives the campaign that was started. */
  constructor({ onStarted }) {
    this.onStarted = onStarted;
    byId("campaign-document").addEventListener("input", () => this.forget());
    byId("campaign-file").addEventListener("change", ({ target }) => this.read(target.files[0]));
    byId("campaign-plan-button").addEventListener("click", () => this.plan());
    byId("campaign-start-test").addEventListener("click", () => this.test());
    byId("campaign-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.start();
    });
    followOperator(byId("campaign-operator"));
    this.forget();
  }

  async read(file) {
    if (!file) return;
    byId("campaign-document").value = await file.text();
    this.forget();
    this.plan();
  }

  /** A changed document needs another dry run. */
  forget(text = "A dry run shows time, heat, disk and limits; nothing moves. Start becomes possible after it.") {
    this.planned = null;
    byId("campaign-begin").disabled = true;
    byId("campaign-plan").replaceChildren();
    this.note(text);
  }

  note(text, isProblem = false) {
    write(byId("campaign-start-note"), text);
    byId("campaign-start-note").classList.toggle("problem", isProblem);
  }

  async plan() {
    const text = byId("campaign-document").value;
    this.forget("Computing the dry run …");
    try {
      const campaign = JSON.parse(text);
      const plan = await post("campaigns/plan", withBench({ campaign, identifiability: false }), PLAN_TIMEOUT_MS);
      if (text !== byId("campaign-document").value) return; // it was changed meanwhile
      const words = element("div", {}, element("p", { className: "soft" }, "Assessing the strokes, for some seconds …"));
      byId("campaign-plan").replaceChildren(...describePlan(plan, words));
      if (plan.methods.length) fillIdentifiability(campaign, words);
      this.planned = campaign;
      byId("campaign-begin").disabled = plan.problems.length > 0;
      this.note(plan.problems.length ? "The campaign cannot be started; see the problems." : "Dry run of this document; it can be started.", plan.problems.length > 0);
    } catch (problem) {
      this.note(problem instanceof SyntaxError ? `The document is not JSON: ${problem.message}.` : problem.after("There is no dry run"), true);
    }
  }

  /** Tries the recipients of the document before the night; nothing is started. */
  async test() {
    this.note("The test message is sent …");
    try {
      const campaign = JSON.parse(byId("campaign-document").value);
      const { result } = await post("campaigns/test-message", { campaign }, TEST_TIMEOUT_MS);
      this.note(result === "sent" ? "The test message was sent to all recipients." : result, result !== "sent");
    } catch (problem) {
      this.note(problem instanceof SyntaxError ? `The document is not JSON: ${problem.message}.` : problem.after("No test message was sent"), true);
    }
  }

  async start() {
    if (!this.planned) return;
    byId("campaign-begin").disabled = true;
    try {
      const campaign = await start("campaigns", withBench({ campaign: this.planned, operator: byId("campaign-operator").value.trim() }));
      this.forget();
      this.onStarted(campaign);
    } catch (problem) {
      this.note(problem.after("Not started"), true);
      byId("campaign-begin").disabled = false;
    }
  }
}

/** Fills in what each method can identify, which is computed after everything else, because it takes longer. */
async function fillIdentifiability(campaign, words) {
  try {
    const { methods } = await post("campaigns/plan", withBench({ campaign }), ASSESSMENT_MS);
    words.replaceChildren(...methods.flatMap((one) => [
      element("h4", {}, `${one.method}, ${describeDrive(one.drive, one.drive_unit)}`),
      element("ul", { className: "words" }, ...one.identifiability.map((line) => element("li", {}, sentence(line)))),
    ]));
  } catch (problem) {
    words.replaceChildren(element("p", { className: "problem" }, problem.after("Not assessed")));
  }
}

function describePlan(plan, words) {
  const { duration_s: expected, longest_s: longest, stroking_s: moving, heat_j: heat, log_bytes: size, free_bytes: free } = plan;
  const rows = {
    Steps: `${plan.steps.length}`,
    "Expected time": duration(expected),
    "Longest time": `${duration(longest)}, and the time of persons`,
    "In motion": duration(moving),
    "Heat, at most": `${significant(heat / 1e3, 3)} kJ`,
    "Logs, at most": `${significant(size / 1e6, 3)} MB${free === null ? "" : `; the disk has ${significant(free / 1e9, 3)} GB free`}`,
  };
  const problems = plan.problems.map((text) => `Problem: ${text}`);
  if (plan.bench_unknown) problems.push(`Limits of the bench are not known: ${plan.bench_unknown}`);
  const identifiability = plan.methods.length ? [element("h3", {}, "What the strokes can identify"), words] : [];
  return [
    element("h3", {}, `Dry run of ${plan.campaign}`),
    element("ul", { className: "warnings", "aria-label": "Problems" }, ...problems.map((text) => element("li", {}, text))),
    factList(rows),
    makeMethodTable(plan.methods), ...identifiability, makeStepTable(plan.steps),
  ];
}

function makeMethodTable(methods) {
  const { scale, unit } = QUANTITIES.force;
  return table("Methods", ["Method", "Runs", "One run", "Force, at most", "Limits", "Checkpoints"], methods.map((one) => [
    `${one.method}, ${describeDrive(one.drive, one.drive_unit)}`, one.runs, duration(one.duration_s), `${significant(one.force_n * scale)} ${unit}`, [one.verdict, ...one.obstacles, ...one.remarks].join("; "), one.checkpoints,
  ]));
}

function makeStepTable(steps) {
  const rows = steps.slice(0, MAX_STEPS).map((step) => [
    `${step.number}. ${step.label}`, describeKind(step.kind), step.longest_s === null ? "a person decides" : duration(step.duration_s),
    step.longest_s === null ? "–" : duration(step.longest_s), step.heat_j ? `${significant(step.heat_j / 1e3, 3)} kJ` : "–",
  ]);
  const more = steps.length > MAX_STEPS ? `, the first ${MAX_STEPS} of ${steps.length}` : "";
  return element("details", {}, element("summary", {}, `Steps in order${more}`), table("Steps in order", ["Step", "Kind", "Expected", "Longest", "Heat, at most"], rows));
}

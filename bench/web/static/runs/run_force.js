// Measured over simulated force of a run: figures of one segment, and the residual of each condition.

import { get } from "../common/api.js";
import { clearPlots } from "../common/axes_plot.js";
import { CurvePlot } from "../common/curve_plot.js";
import { describeCondition, forceText, makeConditionTable } from "./fit_tables.js";
import { element, instant, write } from "../common/format.js";
import { QUANTITIES } from "../common/quantities.js";
import { findDone } from "./run_facts.js";

const POINTS = 700; // intervals whose extremes are kept; more than a screen shows

export class ForceComparison {
  /** Takes the place that it fills, the run, and its noise floor [N]. */
  constructor(place, run, floor) {
    Object.assign(this, { place, run, floor, plots: [], series: null });
    this.note = element("p", { className: "note", role: "status" });
    this.figures = element("div", { className: "figures" });
    this.conditions = element("div");
    this.sources = listSources(run);
  }

  /** Loads the simulation of the newest fit, and shows the segment with the largest force error. */
  async open() {
    const { sources } = this;
    this.source = choice("Simulated by", sources.map(({ label }) => label), (k) => this.openSource(sources[k]));
    this.segment = choice("Segment", [], () => this.showSegment());
    this.place.replaceChildren(
      element("p", { className: "actions" }, ...(sources.length > 1 ? [this.source] : []), this.segment), this.note, this.figures, this.conditions);
    await this.openSource(sources[0]);
  }

  async openSource({ path }) {
    this.path = path;
    try {
      const series = await get(`${path}?points=1`); // the errors of all segments come with any part of the series
      if (path !== this.path) return; // another simulation was chosen meanwhile
      Object.assign(this, { errors: series.errors, driveUnit: series.drive_unit, series: null });
      this.listSegments();
      this.showConditions();
      await this.showSegment();
    } catch (problem) {
      this.fail(problem);
    }
  }

  listSegments() {
    const worst = this.errors.reduce((a, one, k) => (one.rmse_n > (this.errors[a]?.rmse_n ?? -1) ? k : a), 0);
    const select = this.segment.querySelector("select");
    select.replaceChildren(...this.errors.map((one, k) => element("option", { value: k, selected: k === worst },
      `${one.segment}: ${describeCondition(one, this.driveUnit).join(", ")}`)));
    this.segment.hidden = !this.errors.length;
  }

  showConditions() {
    const content = this.errors.length
      ? makeConditionTable(this.errors, this.driveUnit, this.floor)
      : element("p", { className: "soft" }, "The recording has no segments, so that there is no residual by condition.");
    this.conditions.replaceChildren(content);
  }

  async showSegment() {
    const error = this.errors[this.segment.querySelector("select").value];
    const { path } = this;
    const range = error ? `&from=${error.start_s}&to=${error.stop_s}` : "";
    this.wanted = `${path}${range}`;
    const { wanted } = this;
    try {
      const series = await get(`${path}?points=${POINTS}${range}`);
      if (wanted !== this.wanted) return; // another segment was chosen meanwhile
      Object.assign(this, { series, error });
      this.draw();
    } catch (problem) {
      this.fail(problem);
    }
  }

  fail(problem) {
    write(this.note, problem.after("The simulated force cannot be shown"));
    clearPlots(this.plots);
    this.figures.replaceChildren();
  }

  /** Draws the chosen segment in the chosen units. */
  draw() {
    clearPlots(this.plots);
    if (!this.series) return;
    const { displacement, velocity } = QUANTITIES;
    this.plots.push(this.overTime(), this.loop(displacement, "displacement"), this.loop(velocity, "velocity"));
    this.figures.replaceChildren(...this.plots.map(({ figure }) => figure));
    for (const plot of this.plots) plot.draw();
    write(this.note, this.describe());
  }

  describe() {
    const { error, series, floor } = this;
    const reduced = series.decimated ? ` Drawn from the extremes of ${series.samples} samples.` : "";
    if (!error) return `The whole recording.${reduced}`;
    const ratio = floor > 0 ? `, ${(error.rmse_n / floor).toFixed(2)} times the noise floor of ${forceText(floor)}` : "";
    return `${error.segment}: RMSE ${forceText(error.rmse_n)}${ratio}.${reduced}`;
  }

  overTime() {
    const { time, values } = this.series;
    const { unit } = QUANTITIES.force;
    const band = values.lower && { name: "95 % band of the measured force", colour: "--drive", x: time, low: scaled(values.lower), high: scaled(values.upper) };
    return new CurvePlot({ title: "Force over time.", across: "time [s]", up: `force [${unit}]`, curves: this.curves(time), band });
  }

  loop(quantity, name) {
    const across = this.series.values[name].map((value) => value * quantity.scale);
    return new CurvePlot({
      title: `Force against ${name}.`, across: `${name} [${quantity.unit}]`, up: `force [${QUANTITIES.force.unit}]`, curves: this.curves(across),
    });
  }

  curves(x) {
    const { force, simulated } = this.series.values;
    return [
      { name: "measured", colour: "--force", x, y: scaled(force), wide: true },
      { name: "simulated", colour: "--drive", x, y: scaled(simulated) },
    ];
  }

  /** Shows everything again, in changed units. */
  relabel() {
    if (!this.errors) return;
    const { value } = this.segment.querySelector("select");
    this.listSegments();
    this.segment.querySelector("select").value = value;
    this.showConditions();
    this.draw();
  }

  destroy() {
    this.path = this.wanted = null;
    clearPlots(this.plots);
  }
}

const scaled = (force) => force.map((value) => value * QUANTITIES.force.scale);

/** Simulations of the run: its newest fit, then its predictions, the newest first. */
function listSources(run) {
  const fit = findDone(run, "identify");
  const predictions = run.jobs.filter(({ kind, state }) => kind === "predict" && state === "done").toReversed();
  return [
    ...(fit ? [{ path: `fits/${encodeURIComponent(fit.id)}/series`, label: `the newest fit, made ${instant(fit.finished)}` }] : []),
    ...predictions.map(({ id, finished, settings }) => ({
      path: `predictions/${encodeURIComponent(id)}/series`, label: `the prediction of ${instant(finished)}, by model ${settings.model}`,
    })),
  ];
}

function choice(label, texts, onChosen) {
  const select = element("select", {}, ...texts.map((text, value) => element("option", { value }, text)));
  select.addEventListener("change", () => onChosen(Number(select.value)));
  return element("label", { className: "chosen" }, `${label} `, select);
}

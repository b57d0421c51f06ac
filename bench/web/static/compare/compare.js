// View of a comparison of two or more runs: conditions, overlay of one stroke, tolerance band, peaks, energy, parameters.

import { get } from "../common/api.js";
import { compareAddress, comparisonPath, readComparison, selectionAddress } from "./compare_address.js";
import { makeConditions } from "./compare_conditions.js";
import { makeEnergies, makeOverlay, makePeaks } from "./compare_curves.js";
import { makeReferenceForm, makeRunList } from "./compare_form.js";
import { RunPlot } from "./compare_plots.js";
import {
  describeBand, describeStroke, makeDriveVerdicts, makeEnergyTable, makeParameterDifferences, makePeakTable, makeStrokeVerdicts,
} from "./compare_tables.js";
import { byId, element, write, zone } from "../common/format.js";
import { letter, makeLegend } from "./run_styles.js";

/** Time [ms] for the answer of the service, which may read each log for the first time. */
const TIMEOUT_MS = 120_000;
/** Advice by the status of a refusal. */
const ADVICE = {
  404: "Choose other runs.",
  409: "Repair this log in the view of its run, or choose other runs.",
  422: "Choose the runs again.",
};
const TITLES = {
  conditions: "Conditions", runs: "Compared runs", overlay: "Overlay of one stroke, cycles aligned by phase",
  band: "Tolerance band of the reference", peaks: "Peak force against velocity", energy: "Energy per cycle", parameters: "Identified parameters",
};

export class CompareView {
  constructor() {
    this.comparison = null;
    this.plots = new Map();
  }

  /** Shows the comparison of an address. */
  async show({ query }) {
    this.wanted = readComparison(query);
    this.comparison = null;
    this.clear();
    if (this.wanted.runs.length < 2) {
      this.explain("A comparison needs two or more runs. Select them in the list of runs, and press Compare.");
      return;
    }
    await this.load();
  }

  clear() {
    for (const name of this.plots.keys()) this.destroyPlots(name);
    byId("compare").replaceChildren();
  }

  /** Requests the comparison and shows it. */
  async load() {
    const { wanted } = this;
    write(byId("compare-note"), "The runs are compared …");
    try {
      const found = await get(comparisonPath(wanted), TIMEOUT_MS);
      if (wanted !== this.wanted) return; // another comparison was requested meanwhile
      if (!this.comparison) this.build(found);
      this.comparison = found;
      this.render();
      write(byId("compare-note"), "");
    } catch (problem) {
      if (wanted !== this.wanted) return;
      this.explain(`${problem.after("The runs cannot be compared")} ${ADVICE[problem.status] ?? "Reload the page to try again."}`);
    }
  }

  /** Shows why there is no comparison, and the way to the list with the same runs selected. */
  explain(text) {
    write(byId("compare-note"), text);
    if (this.comparison) return;
    const choose = element("a", { className: "button", href: selectionAddress(this.wanted.runs) }, "Choose runs");
    byId("compare").replaceChildren(element("p", { className: "actions" }, choose));
  }

  /** Creates the sections; the fields of the choice stay while results change, so that they keep the focus. */
  build({ runs }) {
    const section = (title) => element("section", { "aria-label": title });
    this.parts = Object.fromEntries(Object.entries(TITLES).map(([name, title]) => [name, section(title)]));
    this.list = element("div", {}, ...makeRunList(runs, this.wanted));
    this.fill("runs", element("p", { className: "soft" }, `Times are ${zone(new Date(runs[0].started))}.`),
      this.list, makeReferenceForm(runs, this.wanted, (choice) => this.choose(choice)));
    byId("compare").replaceChildren(...Object.values(this.parts));
  }

  /** Applies another reference or tolerance, and keeps it in the address. */
  choose(choice) {
    this.wanted = { ...this.wanted, ...choice };
    this.keepAddress();
    this.load();
  }

  /** Writes the choice into the address, and into the links that remove a run. */
  keepAddress() {
    history.replaceState(null, "", compareAddress(this.wanted));
    this.list.replaceChildren(...makeRunList(this.comparison.runs, this.wanted));
  }

  /** Writes numbers again, after a unit has changed. */
  relabel() {
    if (this.comparison) this.render();
  }

  render() {
    const { comparison } = this;
    this.fill("conditions", ...makeConditions(comparison));
    for (const name of ["overlay", "peaks", "energy"]) this.parts[name].hidden = !comparison.strokes.length;
    this.showBand();
    this.showParameters();
    if (!comparison.strokes.length) return;
    this.showOverlay();
    this.showPlotted("peaks", makePeaks(comparison), makePeakTable(comparison));
    this.showPlotted("energy", makeEnergies(comparison), makeEnergyTable(comparison));
  }

  fill(name, ...content) {
    this.parts[name].replaceChildren(element("h2", {}, TITLES[name]), ...content);
  }

  /** Shows a field with all strokes, and the curves of the chosen one. */
  showOverlay() {
    const { strokes, drive_unit: unit } = this.comparison;
    const chosen = Math.max(0, strokes.findIndex(({ name }) => name === this.wanted.stroke));
    const field = element("select", {}, ...strokes.map((stroke, k) =>
      element("option", { value: k, selected: k === chosen }, `${k + 1}. ${stroke.name}: ${describeStroke(stroke, unit)}`)));
    const figures = element("div", { className: "figures three" });
    field.addEventListener("change", () => {
      this.wanted.stroke = strokes[field.value].name;
      this.keepAddress();
      this.plotStroke(strokes[field.value], figures);
    });
    this.fill("overlay", element("label", { className: "stroke" }, "Stroke ", field), makeLegend(this.comparison.runs), figures);
    this.plotStroke(strokes[chosen], figures);
  }

  plotStroke(stroke, figures) {
    figures.replaceChildren();
    this.plot("overlay", figures, makeOverlay(this.comparison, stroke));
  }

  showPlotted(name, content, table) {
    const figures = element("div", { className: "figures" });
    this.fill(name, makeLegend(this.comparison.runs), figures, table);
    this.plot(name, figures, [content]);
  }

  plot(name, figures, contents) {
    this.destroyPlots(name);
    this.plots.set(name, contents.map((content) => new RunPlot(figures, content)));
  }

  destroyPlots(name) {
    for (const plot of this.plots.get(name) ?? []) plot.destroy();
    this.plots.delete(name);
  }

  showBand() {
    const { comparison, wanted } = this;
    const isGiven = comparison.verdicts.length > 0;
    this.fill("band", element("p", { className: "soft" }, describeBand(comparison, wanted.tolerance)),
      ...(isGiven ? [makeDriveVerdicts(comparison), makeStrokeVerdicts(comparison)] : []));
  }

  showParameters() {
    const { parameters, runs } = this.comparison;
    const without = runs.flatMap(({ fit }, place) => (fit ? [] : [letter(place)]));
    const missing = without.length ? `Without a fit: ${without.join(", ")}. Open the run and press Identify, to compare its parameters.` : "";
    this.fill("parameters", element("p", { className: "soft" }, missing),
      ...(parameters.length ? [makeParameterDifferences(this.comparison)] : [element("p", {}, "No parameter is identified in two or more runs.")]));
  }
}

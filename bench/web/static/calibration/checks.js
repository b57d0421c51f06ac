// Zero and shunt checks of the channels: state, latest check and its age, start of a check, and the chart of a chosen one.

import { get, start } from "../common/api.js";
import { benchQuery, withBench } from "../common/bench.js";
import { byId, element, instant, write } from "../common/format.js";
import { CheckChart } from "./check_chart.js";
import { age, describeState, keyOf, nameOf, valueOf, withUnit } from "./check_words.js";

const ADDRESS = "#/calibration?check=";
const KINDS = ["zero", "shunt"];

export class CheckView {
  /** `onStarted` receives a started run. */
  constructor({ onStarted }) {
    Object.assign(this, { onStarted, charts: [], methods: {}, chosen: "", isShown: false });
    this.chart = new CheckChart({ onChanged: (text) => this.load(text) });
    this.form = byId("check-start");
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.start(event.submitter?.value || KINDS[0]);
    });
  }

  /** Loads and lists the charts; `?check=CHANNEL` or `?check=CHANNEL.shunt` chooses one. */
  async show({ query }) {
    this.isShown = true;
    this.chosen = query.get("check") ?? "";
    await this.load();
    if (this.chosen) this.chart.focus();
  }

  async load(answer = "") {
    try {
      const answers = await Promise.all(KINDS.map((kind) => get(benchQuery(`checks/charts?check=${kind}`))));
      const [{ specimen }] = answers;
      this.charts = answers.flatMap(({ items }) => items);
      this.methods = Object.fromEntries(KINDS.map((kind, index) => [kind, answers[index].method]));
      if (!this.form.elements.specimen.value) this.form.elements.specimen.value = specimen;
      write(byId("checks-note"), this.charts.length ? "" : "No checks yet. Start one at rest, with the same specimen each time.");
      this.list();
      write(byId("checks-answer"), answer);
    } catch (problem) {
      write(byId("checks-note"), problem.after("The checks cannot be listed"));
    }
  }

  /** Shows all values again, after other units were chosen. */
  list() {
    byId("checks").replaceChildren(...this.charts.map((chart) => makeRow(chart)));
    const known = this.charts.find(({ series }) => keyOf(series) === this.chosen);
    this.chart.show(known ?? null);
  }

  /** Loads the charts again when a check has ended. */
  update(run) {
    if (this.isShown && run.outcome && KINDS.some((kind) => run.method.startsWith(`${kind}_check`))) this.load();
  }

  async start(kind) {
    if (!this.methods[kind]) {
      await this.load();
      if (!this.methods[kind]) return write(byId("checks-answer"), "Not started: the rig agent does not answer. Start it, then repeat the check.");
    }
    try {
      const run = await start("runs", withBench({ method: this.methods[kind], specimen: this.form.elements.specimen.value.trim() }));
      write(byId("checks-answer"), `The ${kind} check has started. Its result appears here after its end.`);
      this.onStarted(run);
    } catch (problem) {
      write(byId("checks-answer"), problem.after("Not started"));
    }
  }
}

function makeRow(chart) {
  const { series, points, limits } = chart;
  const { channel, specimen } = series;
  const { kind, word, reason } = describeState(chart);
  const latest = points.at(-1);
  return element("tr", {},
    element("th", { scope: "row" }, nameOf(series)),
    element("td", {}, element("span", { className: `mark ${kind}` }, word), element("small", {}, reason)),
    element("td", {}, ...(latest ? [age(latest.measured), element("small", {}, instant(latest.measured))] : ["–"])),
    element("td", { className: "number" }, ...(latest
      ? [valueOf(latest.value, series), element("small", {}, `standard uncertainty ${withUnit(latest.standard_uncertainty, channel, 2)}`)] : ["–"])),
    element("td", { className: "number" }, limits ? `${valueOf(limits.lower, series)} … ${valueOf(limits.upper, series)}` : "–"),
    element("td", {}, specimen || "not named"),
    element("td", {}, element("a", { className: "button", href: `${ADDRESS}${keyOf(series)}`, "aria-label": `Chart of the ${nameOf(series)}` }, "Chart")));
}

// Control chart of one channel: state in words, figure, table of the checks, and the begin of a new baseline.

import { start } from "../common/api.js";
import { benchQuery } from "../common/bench.js";
import { byId, element, localTime, spaced, write, zone } from "../common/format.js";
import { need } from "../common/rights.js";
import { runAddress } from "../common/router.js";
import { table } from "../common/tables.js";
import { CheckPlot } from "./check_plot.js";
import { describeState, listRules, nameOf, quantityOf, valueOf, withUnit } from "./check_words.js";

/** Name of the value by kind of check, in the title of the figure and in the head of the table. */
const VALUES = { zero: ["Zero", "Mean"], shunt: ["Change by the shunt", "Change"] };

export class CheckChart {
  /** `onChanged` is called after a new baseline has begun, with a sentence for the person. */
  constructor({ onChanged }) {
    this.onChanged = onChanged;
    this.place = byId("check-chart");
    this.plot = null;
  }

  /** Shows a chart; null for none. */
  show(chart) {
    this.plot?.destroy();
    this.plot = null;
    this.place.replaceChildren();
    if (!chart) return;
    const { channel, check, specimen } = chart.series;
    const { word, reason } = describeState(chart);
    this.title = element("h3", { tabIndex: -1 }, `Chart of the ${nameOf(chart.series)}, specimen ${specimen || "not named"}`);
    const figure = element("figure", { className: "curves" });
    this.place.append(this.title, element("p", { className: "cause" }, `${word}: ${reason}.`),
      element("p", { className: "soft" }, describeLimits(chart)), figure, makeTable(chart), this.makeBaseline(chart));
    if (chart.points.length) this.plot = new CheckPlot(figure, { ...chart, ...quantityOf(channel), title: `${VALUES[check][0]} of the ${spaced(channel)}` });
    else figure.remove();
  }

  focus() {
    this.title?.focus();
  }

  /** Button that asks for a reason, in the place of the button. */
  makeBaseline({ series }) {
    const place = element("div");
    const open = need("change_limits", element("button", { type: "button" }, "Begin a new baseline …"));
    const buttons = element("p", { className: "buttons" }, open);
    open.addEventListener("click", () => {
      const form = this.makeForm(series, () => {
        place.replaceChildren(buttons);
        open.focus();
      });
      place.replaceChildren(form);
      form.elements.reason.focus();
    });
    place.append(buttons);
    return place;
  }

  makeForm(series, onCancelled) {
    const { channel, check, specimen } = series;
    const note = element("p", { className: "note", role: "alert" });
    const cancel = element("button", { type: "button" }, "Cancel");
    const form = element("form", { className: "form record-form" },
      element("p", {}, `Only checks of the ${nameOf(series)} from now on count. The earlier ones stay in the list of checks.`),
      element("label", {}, element("span", {}, "Reason, such as a repair"), element("input", { name: "reason", required: true, maxLength: 500 })),
      element("p", { className: "buttons" }, cancel, element("button", { className: "primary" }, "Begin baseline")), note);
    cancel.addEventListener("click", onCancelled);
    form.addEventListener("submit", async (event) => {
      event.preventDefault();
      try {
        await start(benchQuery(`checks/${channel}/baseline`), { check, specimen: specimen || null, reason: form.elements.reason.value.trim() });
        await this.onChanged(`A new baseline of the ${nameOf(series)} has begun.`);
      } catch (problem) {
        write(note, problem.after("Not changed"));
      }
    });
    return form;
  }
}

function describeLimits({ series, limits, count, needed }) {
  const since = `Centre and limits follow from the first ${needed} checks (ISO 7870-2)`;
  if (!limits) return `${since}; there are ${count}.`;
  const { centre, sigma, lower, upper } = limits;
  return `${since}: centre ${valueOf(centre, series)}, limits ${valueOf(lower, series)} and ${valueOf(upper, series)}, `
    + `standard deviation between checks ${withUnit(sigma, series.channel)}.`;
}

function makeTable({ series: { channel, check }, points }) {
  const { unit } = quantityOf(channel);
  const digits = check === "zero" ? 4 : 6;
  const rows = points.map((point, index) => [
    String(index + 1), element("a", { className: "link", href: runAddress(point.run) }, localTime(point.measured)),
    withUnit(point.value, channel, digits), withUnit(point.standard_uncertainty, channel, 2),
    point.ewma === null ? "–" : withUnit(point.ewma, channel, digits), point.is_baseline ? "baseline" : "", listRules(point),
  ]).reverse();
  const heads = ["Number", `Measured (${zone()})`, `${VALUES[check][1]} [${unit}]`, `Standard uncertainty [${unit}]`, `Weighted mean [${unit}]`, "Part", "Out of control by"];
  return element("details", {}, element("summary", {}, `${points.length} checks as a table`), table(`${VALUES[check][0]} of the ${spaced(channel)} in each check`, heads, rows));
}

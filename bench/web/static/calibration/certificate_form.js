// Form of one certificate: a new one, or the correction of one, which is stored as its next version.

import { patch, start } from "../common/api.js";
import { benchQuery } from "../common/bench.js";
import { element, spaced, write } from "../common/format.js";

/** SI unit of each channel, in which points and uncertainty are entered. */
const UNITS = { force: "N", displacement: "m", coil_voltage: "V", coil_current: "A", actuator_position: "m", temperature: "degC" };
const PERCENT = 100;

export class CertificateForm {
  /** Takes the view of the certificate to correct, or null; `onStored` receives a sentence for the person. */
  constructor(view, { onStored, onCancelled }) {
    Object.assign(this, { view, onStored });
    this.note = element("p", { className: "note", role: "alert" });
    this.place = element("form", { className: "form" },
      element("h2", {}, view ? `Correct certificate ${view.document.number}` : "Add a certificate"),
      element("div", { className: "fields" }, ...this.makeFields()),
      element("p", { className: "buttons" }, this.makeCancel(onCancelled), element("button", { className: "primary" }, view ? "Store correction" : "Add")),
      this.note);
    if (view) this.fill(view.document);
    this.nameUnits();
    this.fields.channel.addEventListener("change", () => this.nameUnits());
    this.fields.kind.addEventListener("change", () => this.nameUnits());
    this.place.addEventListener("submit", (event) => {
      event.preventDefault();
      this.store();
    });
  }

  get fields() {
    return this.place.elements;
  }

  focus() {
    this.fields[this.view ? "reason" : "channel"].focus();
  }

  makeFields() {
    const fixed = Boolean(this.view); // these name the certificate, so that a correction keeps them
    const text = (name, more = {}) => element("input", { name, required: true, maxLength: 200, ...more });
    const options = Object.keys(UNITS).map((name) => element("option", { value: name }, spaced(name)));
    const kinds = [["relative", "in % of the indication"], ["absolute", "in the channel's unit"]];
    return [
      ...(fixed ? [labelled("Reason of the correction", text("reason", { maxLength: 500 }))] : []),
      labelled("Channel", element("select", { name: "channel", disabled: fixed }, ...options)),
      labelled("Laboratory", text("laboratory", { disabled: fixed })),
      labelled("Number of the certificate", text("number", { disabled: fixed })),
      labelled("Day of the calibration", text("date", { type: "date" })),
      labelled("Valid until, this day included", text("due", { type: "date" })),
      labelled("Points", element("textarea", { name: "points", rows: 5, required: true, spellcheck: false })),
      labelled("Uncertainty is given", element("select", { name: "kind" },
        ...kinds.map(([value, words]) => element("option", { value }, words)))),
      labelled("Uncertainty", text("value", { type: "number", step: "any", min: 0 })),
      labelled("Coverage factor k (1 for a standard uncertainty)", text("coverage_factor", { type: "number", step: "any", min: 1, max: 10, value: "2" })),
      labelled("Standard that was used", text("standard")),
      labelled("Note", text("note", { required: false, maxLength: 2000 })),
    ];
  }

  makeCancel(onCancelled) {
    const cancel = element("button", { type: "button" }, "Cancel");
    cancel.addEventListener("click", onCancelled);
    return cancel;
  }

  /** Writes the unit of the channel into the labels. */
  nameUnits() {
    const { channel, kind, points, value } = this.fields;
    const unit = UNITS[channel.value].replace("degC", "°C");
    write(points.parentElement.firstChild, `Points: reference and indication [${unit}], one pair on each line`);
    write(value.parentElement.firstChild, `Uncertainty [${kind.value === "relative" ? "%" : unit}]`);
  }

  fill(one) {
    const { value, kind, coverage_factor: factor } = one.uncertainty;
    const texts = {
      ...one, kind, value: kind === "relative" ? Number((PERCENT * value).toPrecision(12)) : value, coverage_factor: factor,
      points: one.points.map(({ reference, indicated }) => `${reference} ${indicated}`).join("\n"),
    };
    for (const name of ["channel", "laboratory", "number", "date", "due", "points", "kind", "value", "coverage_factor", "standard", "note"]) {
      this.fields[name].value = texts[name];
    }
  }

  async store() {
    const { points, wrong } = parsePoints(this.fields.points.value);
    if (wrong) return write(this.note, `Not stored: line ${wrong} of the points has not two numbers. Give reference and indication, with a space between them.`);
    write(this.note, "Storing …");
    try {
      await this.send(points);
    } catch (problem) {
      write(this.note, problem.after("Not stored"));
    }
  }

  async send(points) {
    const { channel, laboratory, number, kind, value, coverage_factor: factor, reason } = this.fields;
    const size = Number(value.value) / (kind.value === "relative" ? PERCENT : 1);
    const content = {
      ...Object.fromEntries(["date", "due", "standard", "note"].map((name) => [name, this.fields[name].value.trim()])),
      points, uncertainty: { value: size, kind: kind.value, coverage_factor: Number(factor.value) },
    };
    if (this.view) {
      const { version } = await patch(`certificates/${encodeURIComponent(this.view.id)}`, { reason: reason.value.trim(), ...content });
      return this.onStored(`The correction is stored as version ${version}; the earlier ones stay.`);
    }
    await start(benchQuery("certificates"), {
      ...content, channel: channel.value, unit: UNITS[channel.value], laboratory: laboratory.value.trim(), number: number.value.trim(),
    });
    return this.onStored("The certificate is stored. Runs that start from now on name it.");
  }
}

/** Reads pairs of numbers, as typed or pasted from a table; a comma is a decimal point. Returns the number of a wrong line. */
export function parsePoints(text) {
  const points = [];
  for (const [index, line] of text.split("\n").entries()) {
    const numbers = line.trim().split(/[\s;]+/).filter(Boolean).map((one) => Number(one.replace(",", ".").replace("−", "-")));
    if (numbers.length === 0) continue;
    if (numbers.length !== 2 || !numbers.every(Number.isFinite)) return { points, wrong: index + 1 };
    points.push({ reference: numbers[0], indicated: numbers[1] });
  }
  return { points, wrong: 0 };
}

const labelled = (text, field) => element("label", {}, element("span", {}, text), field);

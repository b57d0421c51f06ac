// Facts on a specimen, and the form that changes them without losing a change by someone else.

import { getTag, patch } from "../common/api.js";
import { element, instant, significant, write, describeDriveKind } from "../common/format.js";
import { QUANTITIES } from "../common/quantities.js";
import { need } from "../common/rights.js";
import { factList } from "../common/tables.js";

const CHANGED_MEANWHILE = 412;
const DRIVE_KINDS = ["coil_v", "coil_a", "driver_command_v"];
const plain = (unit) => ({ unit, scale: 1 });
const driveUnit = (kind) => (kind === "coil_a" ? "A" : kind ? "V" : "V or A");
/** Known limits: field, name, and unit by the kind of drive. */
const LIMITS = [
  ["stroke_m", "Limit of stroke from the middle", () => QUANTITIES.displacement],
  ["velocity_mps", "Limit of velocity", () => QUANTITIES.velocity],
  ["force_n", "Limit of force", () => QUANTITIES.force],
  ["drive", "Limit of drive", (kind) => plain(driveUnit(kind))],
  ["temperature_c", "Limit of temperature", () => plain("°C")],
];

/** What a person may change: field, name, and its value as text with its unit. */
const FIELDS = [
  ["description", "Description", (one) => one.description],
  ["damper_kind", "Kind of damper", (one) => one.damper_kind],
  ["drive_kind", "Drive", (one) => describeDriveKind(one.drive_kind)],
  ...LIMITS.map(([name, label, quantity]) => [name, label, (one) => {
    const { unit, scale } = quantity(one.drive_kind);
    const value = one.limits[name];
    return value === null || value === undefined ? "" : `${significant(value * scale)} ${unit}`;
  }]),
];

export class SpecimenFacts {
  constructor() {
    this.form = null;
    this.place = element("section", { "aria-label": "Facts" });
  }

  /** Shows a specimen with the ETag under which it was read; an open form stays, with its own ETag. */
  show(specimen, etag) {
    if (this.form) return;
    Object.assign(this, { specimen, etag });
    this.fill();
  }

  /** Shows the facts in changed units; an open form keeps the units of its labels. */
  relabel() {
    if (!this.form) this.fill();
  }

  fill(answer = "") {
    this.form = null;
    const { serial, registered, runs, last_run: last } = this.specimen;
    const rows = [
      ["Serial number", serial], ...FIELDS.map(([, label, read]) => [label, read(this.specimen) || "not given"]),
      ["Runs", String(runs)], ["Last run", instant(last)],
      ["Described first", registered ? instant(registered) : "not yet; only runs name it"],
    ];
    const list = factList(Object.fromEntries(rows));
    this.edit = need("operate", element("button", { type: "button" }, "Edit facts"));
    this.edit.addEventListener("click", () => this.open());
    this.place.replaceChildren(element("h2", {}, "Facts"), list, this.edit, element("p", { className: "note", role: "status" }, answer));
  }

  open() {
    this.form = new FactsForm(this.specimen);
    const { place } = this.form;
    place.addEventListener("submit", (event) => {
      event.preventDefault();
      this.save();
    });
    this.form.cancel.addEventListener("click", () => this.close("Nothing was changed."));
    this.place.replaceChildren(element("h2", {}, "Facts"), place);
    place.elements.description.focus();
  }

  close(answer) {
    this.fill(answer);
    this.edit.focus();
  }

  async save() {
    const { form } = this;
    const change = form.read();
    if (!Object.keys(change).length) return this.close("Nothing was changed.");
    write(form.note, "Saving …");
    try {
      await patch(this.path, change, this.etag);
      await this.reload();
      if (form === this.form) this.close("Saved.");
    } catch (problem) {
      await (problem.status === CHANGED_MEANWHILE ? this.explain(form) : write(form.note, problem.after("Not saved")));
    }
  }

  get path() {
    return `specimens/${encodeURIComponent(this.specimen.serial)}`;
  }

  async reload() {
    const { data, etag } = await getTag(this.path);
    Object.assign(this, { specimen: data, etag });
  }

  /** Says what someone else has changed meanwhile; the person's own entries stay, and are saved at the next attempt. */
  async explain(form) {
    const before = this.specimen;
    try {
      await this.reload();
    } catch (problem) {
      return write(form.note, problem.after("Not saved, and the present facts cannot be read"));
    }
    const changes = FIELDS.filter(([, , read]) => read(before) !== read(this.specimen))
      .map(([, label, read]) => `${label} is now “${read(this.specimen) || "not given"}”`);
    write(form.note, `Not saved, because someone else has changed this specimen meanwhile: ${changes.join("; ") || "with the same values"}. `
      + "Your entries are still here: save again to set them, or cancel to keep the other change.");
    form.rebase(this.specimen);
  }
}

/** Form with the facts that a person may change, in the person's units. */
class FactsForm {
  constructor(specimen) {
    this.specimen = specimen;
    this.note = element("p", { className: "note", role: "alert" });
    this.cancel = element("button", { type: "button" }, "Cancel");
    this.units = Object.fromEntries(LIMITS.map(([name, , quantity]) => [name, { ...quantity(specimen.drive_kind) }]));
    const kinds = DRIVE_KINDS.map((kind) => element("option", { value: kind }, describeDriveKind(kind)));
    this.place = element("form", { className: "form" },
      element("div", { className: "fields" },
        labelled("Description", element("textarea", { name: "description", maxLength: 2000, rows: 3 })),
        labelled("Kind of damper, such as its type number", element("input", { name: "damper_kind", maxLength: 200 })),
        labelled("Drive", element("select", { name: "drive_kind" }, element("option", { value: "" }, "not known"), ...kinds)),
        ...LIMITS.map(([name, label]) => labelled(`${label} [${this.units[name].unit}]`,
          element("input", { name, type: "number", step: "any" })))),
      element("p", { className: "buttons" }, this.cancel, element("button", { className: "primary" }, "Save")), this.note);
    for (const name of this.names) this.place.elements[name].value = this.text(name);
    this.place.elements.drive_kind.addEventListener("change", ({ target }) =>
      write(this.place.elements.drive.parentElement.firstChild, `Limit of drive [${driveUnit(target.value)}]`));
    this.begun = this.entries();
  }

  get names() {
    return ["description", "damper_kind", "drive_kind", ...Object.keys(this.units)];
  }

  /** Stored value as the text of its field, with so many digits that nothing is lost by reading it back. */
  text(name) {
    if (!(name in this.units)) return this.specimen[name] ?? "";
    const value = this.specimen.limits[name];
    return value === null || value === undefined ? "" : String(Number((value * this.units[name].scale).toPrecision(8)));
  }

  entries() {
    return Object.fromEntries(this.names.map((name) => [name, this.place.elements[name].value.trim()]));
  }

  /** Takes over what is stored now in the fields that the person has not touched. */
  rebase(specimen) {
    const now = this.entries();
    const untouched = this.names.filter((name) => now[name] === this.begun[name]);
    this.specimen = specimen;
    for (const name of untouched) {
      this.place.elements[name].value = this.text(name);
      this.begun[name] = this.entries()[name];
    }
  }

  /** Returns what the person has changed, in SI; the limits are sent as a whole. */
  read() {
    const now = this.entries();
    const changed = Object.keys(now).filter((name) => now[name] !== this.begun[name]);
    const change = {};
    for (const name of changed) if (!(name in this.units)) change[name] = name === "drive_kind" ? now[name] || null : now[name];
    const limits = changed.filter((name) => name in this.units);
    if (limits.length) {
      change.limits = { ...this.specimen.limits };
      for (const name of limits) change.limits[name] = now[name] === "" ? null : Number(now[name]) / this.units[name].scale;
    }
    return change;
  }
}

const labelled = (text, field) => element("label", {}, element("span", {}, text), field);

// Plan: choose a method, see its strokes and limits, preview motion and drive over time, and forecast the run.

import { get } from "../common/api.js";
import { benchQuery } from "../common/bench.js";
import { clearPlots } from "../common/axes_plot.js";
import { makeForecast } from "./forecast.js";
import { byId, describeDriveKind, duration, element, fixed, significant, write } from "../common/format.js";
import { MethodEditor } from "./method_editor.js";
import { MethodVersions } from "./method_versions.js";
import { plotPreview } from "./plan_plot.js";
import { QUANTITIES } from "../common/quantities.js";
import { need } from "../common/rights.js";
import { factList, rowTable } from "../common/tables.js";

/** Address of a new method; a method of this name is edited at `#/plan/new/edit`. */
const NEW = "new";

export class PlanView {
  constructor() {
    this.name = "";
    this.plots = [];
    this.editor = null;
  }

  /** Shows the method of an address, or its editor; without one, only the list. */
  async show({ id, part }) {
    const isNew = id === NEW && !part;
    this.editor?.destroy();
    Object.assign(this, { name: isNew ? "" : id, editor: isNew || part === "edit" ? new MethodEditor((stored) => this.showStored(stored)) : null });
    try {
      await this.list();
      if (this.editor) await this.edit(this.editor);
      else if (id) await this.load(id);
      else this.close("Choose a method");
    } catch (problem) {
      write(byId("plan-note"), problem.after("The method cannot be shown"));
    }
  }

  async list() {
    const methods = (await get(benchQuery("methods"))).items.sort((a, b) => a.duration_s - b.duration_s);
    byId("plan-methods").replaceChildren(...methods.map(({ name, title, duration_s: length, version, obstacle, approved }) => {
      const link = element("a", { href: `#/plan/${encodeURIComponent(name)}` }, element("strong", {}, name),
        ` ${duration(length)}${version > 1 ? `, version ${version}` : ""}${approved ? ", approved" : ""}`);
      if (name === this.name) link.setAttribute("aria-current", "page");
      const reason = obstacle ? element("small", { className: "attention" }, `Not on this bench: ${obstacle}`) : null;
      return element("li", {}, link, element("small", {}, title), reason);
    }));
  }

  /** Opens the editor on a copy of the method of the address, or on a new one. */
  async edit(editor) {
    this.close(this.name ? `Edit a copy of ${this.name}` : "New method");
    write(byId("plan-note"), "Loading …");
    const place = await editor.open(this.name);
    if (editor !== this.editor) return; // another address was opened meanwhile
    write(byId("plan-note"), "");
    byId("plan").replaceChildren(place);
  }

  showStored({ name, version }) {
    this.answer = `Stored as version ${version} of ${name}.`;
    location.hash = `#/plan/${encodeURIComponent(name)}`;
  }

  close(title) {
    clearPlots(this.plots);
    byId("plan").replaceChildren();
    write(byId("plan-note"), "");
    write(byId("plan-title"), title);
  }

  async load(name) {
    write(byId("plan-note"), "Loading …");
    const path = `methods/${encodeURIComponent(name)}`;
    const [method, preview] = await Promise.all([get(path), get(`${path}/preview`)]);
    if (name !== this.name) return; // another method was chosen meanwhile
    write(byId("plan-title"), method.title);
    write(byId("plan-note"), this.answer ?? "");
    this.answer = "";
    this.build(method, preview);
  }

  build(method, preview) {
    const use = element("a", { className: "button primary", href: `#/bench?method=${encodeURIComponent(method.name)}` }, "Use on the bench");
    const copy = need("manage_methods", element("a", { className: "button", href: `#/plan/${encodeURIComponent(method.name)}/edit` }, "Edit a copy"));
    const places = element("div", { className: "previews" });
    const versions = new MethodVersions(method.name);
    byId("plan").replaceChildren(
      element("p", {}, method.description), facts(method, preview), element("p", { className: "actions" }, use, copy),
      element("h3", {}, "Preview"), places, makeForecast(method.name),
      versions.section, element("h3", {}, "Segments"), segmentTable(method, preview));
    versions.load();
    clearPlots(this.plots);
    this.plots = plotPreview(preview, places);
  }

  /** Shows the method again, in changed units. */
  relabel() {
    if (this.editor) this.editor.relabel();
    else if (this.name) this.load(this.name).catch((problem) => write(byId("plan-note"), problem.message));
  }
}

function facts(method, preview) {
  const { limits } = method;
  const [length, speed, force] = [QUANTITIES.displacement, QUANTITIES.velocity, QUANTITIES.force];
  const shown = (value, quantity) => `${significant(value * quantity.scale)} ${quantity.unit}`;
  const checkpoints = preview.segments.filter((segment) => segment.checkpoint).map(({ name }) => name);
  const rows = {
    Duration: duration(preview.duration_s),
    Drive: describeDriveKind(method.drive_kind),
    "Sampling rate": `${method.rate_hz} Hz`,
    "Limit of displacement": `± ${shown(limits.stroke_m, length)}`,
    "Limit of velocity": shown(limits.velocity_mps, speed),
    "Limit of acceleration": `${limits.acceleration_mps2} m/s²`,
    "Limit of force": shown(limits.force_n, force),
    "Limit of drive": `${limits.drive} ${preview.drive_unit}`,
    Checkpoints: checkpoints.join(", ") || "none",
  };
  return factList(rows);
}

/** Segments as they will be logged: a staircase of drives becomes one segment for each level. */
function segmentTable(method, preview) {
  const planned = (name) => method.segments.find((one) => name === one.name || name.startsWith(`${one.name}_`));
  const rows = preview.segments.map(({ name, start_s: start, end_s: end }) => element("tr", {},
    element("th", { scope: "row" }, name), element("td", {}, describeMotion(planned(name))),
    element("td", { className: "number right" }, `${fixed(start, 1)} s`), element("td", { className: "number right" }, `${fixed(end - start, 1)} s`)));
  const heads = ["Segment", "Motion", "Starts", "Lasts"].map((text, k) =>
    element("th", { scope: "col", className: k > 1 ? "right" : "" }, text));
  return rowTable("Segments", heads, rows);
}

function describeMotion(segment) {
  if (!segment) return "–";
  const { kind, amplitude_m: amplitude, frequency_hz: frequency } = segment.motion;
  const { scale, unit } = QUANTITIES.displacement;
  const size = amplitude ? `${significant(amplitude * scale)} ${unit}` : "";
  return [kind, size, frequency ? `${frequency} Hz` : ""].filter(Boolean).join(", ");
}

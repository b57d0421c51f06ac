// Results of a run: diagnosis, next stroke, measured over simulated force, parameters and provenance.

import { get } from "../common/api.js";
import { makeDriveTable, makeParameterTable } from "./fit_tables.js";
import { element, spaced } from "../common/format.js";
import { makeNextStroke } from "./next_stroke.js";
import { DiagnosisPart } from "./run_diagnosis.js";
import { loadChanges, makeChanges } from "./result_changes.js";
import { describeMissing, findDone, isFitted } from "./run_facts.js";
import { ForceComparison } from "./run_force.js";
import { foldedSection } from "../common/tables.js";

export class RunResults {
  constructor() {
    this.diagnosis = foldedSection("Diagnosis", { open: true });
    this.next = foldedSection("Next stroke", { open: true });
    this.force = foldedSection("Measured over simulated", { open: true });
    this.parameters = foldedSection("Parameters and force error by drive", { open: true });
    this.provenance = foldedSection("Provenance");
    this.documents = {};
    for (const { section } of [this.next, this.parameters, this.provenance]) section.hidden = true; // until they have content
  }

  get sections() {
    return [this.diagnosis, this.next, this.force, this.parameters, this.provenance].map(({ section }) => section);
  }

  /** Loads fit and diagnosis of a run, and shows them; where one is missing, the reason. */
  async load(run) {
    const done = run.jobs.filter(({ state }) => state === "done").map(({ id }) => id).join();
    const isKnown = done === this.done;
    Object.assign(this, { run, done });
    if (isKnown) return this.showMissing();
    const path = `runs/${encodeURIComponent(run.id)}`;
    const [fit, diagnosis, calibrated, fitChanges, diagnosisChanges] = await Promise.all([
      isFitted(run) ? get(`${path}/fit`) : null, findDone(run, "diagnose") ? get(`${path}/diagnosis`) : null,
      isFitted(run) ? get(`${path}/fit/calibration`).catch(() => null) : null, // a fit of several logs has none
      loadChanges(run, "identify"), loadChanges(run, "diagnose"),
    ]);
    const driveUnit = fit?.drive_unit ?? (diagnosis && (await get(`${path}/segments`)).drive_unit);
    if (run !== this.run) return; // another state of the run was shown meanwhile
    this.documents = { fit, diagnosis, calibrated, driveUnit, fitChanges, diagnosisChanges };
    this.showDiagnosis();
    this.showFit();
    this.showMissing();
    this.showProvenance();
    await this.showForce();
  }

  /** Says why fit or diagnosis are missing. */
  showMissing() {
    const { run, documents: { fit, diagnosis } } = this;
    if (!diagnosis) this.diagnosis.body.replaceChildren(missing(run, "diagnose"));
    if (!fit) this.force.body.replaceChildren(missing(run, "identify"));
  }

  showDiagnosis() {
    const { run, documents: { diagnosis, driveUnit } } = this;
    this.part?.destroy();
    this.part = diagnosis && new DiagnosisPart(this.diagnosis.body, diagnosis, driveUnit);
    this.part?.show();
    this.next.section.hidden = !diagnosis?.next_stroke;
    if (diagnosis?.next_stroke) this.next.body.replaceChildren(...makeNextStroke(run, diagnosis, driveUnit));
  }

  showFit() {
    const { fit, calibrated } = this.documents;
    this.parameters.section.hidden = !fit;
    if (fit) this.parameters.body.replaceChildren(...makeParameterTable(fit, calibrated), makeDriveTable(fit));
  }

  async showForce() {
    const { run, documents: { fit } } = this;
    this.comparison?.destroy();
    this.comparison = fit && new ForceComparison(this.force.body, run, fit.noise_floor_n);
    await this.comparison?.open();
  }

  showProvenance() {
    const { fit, diagnosis, fitChanges, diagnosisChanges } = this.documents;
    const parts = [
      ...(fit ? [...describeOrigin("Fit", fit), ...makeChanges("Fit", fitChanges)] : []),
      ...(diagnosis ? [...describeOrigin("Diagnosis", diagnosis), ...makeChanges("Diagnosis", diagnosisChanges)] : []),
    ];
    this.provenance.section.hidden = !parts.length;
    this.provenance.body.replaceChildren(...parts);
  }

  /** Shows everything in changed units. */
  relabel() {
    if (!this.run) return;
    this.showDiagnosis();
    this.showFit();
    this.comparison?.relabel();
  }

  destroy() {
    this.run = null;
    this.part?.destroy();
    this.comparison?.destroy();
  }
}

const missing = (run, kind) => element("p", { className: "soft" }, describeMissing(run, kind));

function describeOrigin(name, { provenance: { version, seed, logs, settings } }) {
  const chosen = Object.entries(settings).filter(([, value]) => value !== null).map(([key, value]) => `${spaced(key)}: ${value}`);
  const lines = [`Made by version ${version} of mrbench, seed ${seed}.`, ...Object.entries(logs).map(([log, hash]) => `${log}: SHA-256 ${hash}`), `Settings: ${chosen.join("; ") || "those by default"}.`];
  return [element("h3", {}, name), ...lines.map((text) => element("p", { className: "path" }, text))];
}

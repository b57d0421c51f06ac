// Tables of a fit: force error by drive and by condition, and parameters with their intervals.

import { element, significant, spaced } from "../common/format.js";
import { QUANTITIES } from "../common/quantities.js";
import { table } from "../common/tables.js";

/** Force [N] in the chosen unit, without the unit. */
export const inForceUnit = (newtons, digits = 3) => significant(newtons === null ? null : newtons * QUANTITIES.force.scale, digits);

/** Force [N] with the chosen unit. */
export const forceText = (newtons, digits = 3) => (newtons === null ? "not known" : `${inForceUnit(newtons, digits)} ${QUANTITIES.force.unit}`);

/** Share as a percentage. */
export const percent = (share, digits = 3) => (share === null || share === undefined ? "–" : `${significant(100 * share, digits)} %`);

/** 95 % interval of a share in words, with a space before it; empty without one. */
export const shareInterval = (interval) => (interval ? ` (95 % interval ${percent(interval[0])} to ${percent(interval[1])})` : "");

/** Force error at each drive beside the noise floor. */
export function makeDriveTable(fit) {
  const unit = fit.per_drive[0]?.unit ?? fit.drive_unit;
  const drives = fit.per_drive.map((one) => one.drive);
  const quantum = 10 ** Math.floor(Math.log10((Math.max(...drives) - Math.min(...drives)) / 500 || 1e-4));
  // Measured drives, rounded to a five-hundredth of their span.
  const rounded = (drive) => significant(Math.round(drive / quantum) * quantum + 0, 3);
  const rows = fit.per_drive.map((one) => [rounded(one.drive), inForceUnit(one.rmse_n), percent(one.nrmse), String(one.samples)]);
  return table(`Force error by drive; noise floor ${forceText(fit.noise_floor_n)}`,
    [`Drive [${unit}]`, `RMSE [${QUANTITIES.force.unit}]`, "NRMSE", "Samples"], rows);
}

/** Force error of each segment beside the noise floor. */
export function makeConditionTable(errors, driveUnit, floor) {
  const { unit } = QUANTITIES.force;
  const rows = errors.map((one) => [
    one.segment, ...describeCondition(one, driveUnit), inForceUnit(one.rmse_n), floor > 0 ? significant(one.rmse_n / floor, 3) : "–",
    inForceUnit(one.bias_n), one.held_out ? "no" : "yes", String(one.samples),
  ]);
  return table(`Residual by condition; noise floor ${forceText(floor)}`,
    ["Segment", "Amplitude", "Frequency", "Drive", `RMSE [${unit}]`, "RMSE / noise floor", `Mean of simulated − measured [${unit}]`, "Used by a fit", "Samples"], rows);
}

/** Amplitude, frequency and drive of a condition as texts with their units. */
export function describeCondition({ amplitude_m: amplitude, frequency_hz: frequency, drive_value: drive }, driveUnit) {
  const { scale, unit } = QUANTITIES.displacement;
  return [
    amplitude ? `${significant(amplitude * scale, 3)} ${unit}` : "varies",
    frequency ? `${significant(frequency, 3)} Hz` : "not periodic",
    drive === null ? "varies" : `${significant(drive, 3)} ${driveUnit}`,
  ];
}

/**
 * Parameters of the modified Bouc-Wen law with 95 % intervals, as elements.
 *
 * `calibrated` has the intervals with the calibration; they are shown if a channel had a certificate.
 */
export function makeParameterTable(fit, calibrated = null) {
  const withCalibration = Object.values(calibrated?.parameters ?? {}).some(({ calibration }) => calibration);
  const rows = Object.entries(fit.parameters).map(([name, { value, unit, ci95, note }]) => [
    spaced(name), significant(value), ci95 ? intervalText(ci95) : "not determined",
    ...(withCalibration ? [describeCalibrated(calibrated.parameters[name])] : []), unit === "1" ? "–" : unit, note,
  ]);
  const heads = ["Parameter", "Value", "95 % interval", ...(withCalibration ? ["95 % interval with calibration"] : []), "Unit", "Note"];
  const made = table("Parameters of the modified Bouc-Wen law", heads, rows);
  return withCalibration ? [made, element("p", { className: "soft" }, `Interval with calibration: ${calibrated.formula}`)] : [made];
}

const intervalText = ([low, high]) => `${significant(low)} … ${significant(high)}`;

function describeCalibrated(found) {
  if (!found) return "–";
  if (found.missing.length) return `no certificate of ${found.missing.join(" and ")}`;
  return found.ci95 ? intervalText(found.ci95) : "not determined";
}

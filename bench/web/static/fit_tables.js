// Tables of a fit: force error by drive, and parameters with their intervals.

import { element } from "./format.js";

/** Formats a number with significant digits and a true minus sign, in exponents only where they are needed. */
export function significant(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  const text = size && (size >= 1e6 || size < 1e-3) ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
  return text.replaceAll("-", "−").replace("e+", "e");
}

/** Force error at each drive beside the noise floor. */
export function makeDriveTable(fit) {
  const unit = fit.per_drive[0]?.unit ?? fit.drive_unit;
  const drives = fit.per_drive.map((one) => one.drive);
  const quantum = 10 ** Math.floor(Math.log10((Math.max(...drives) - Math.min(...drives)) / 500 || 1e-4));
  // Measured drives, rounded to a five-hundredth of their span.
  const rounded = (drive) => significant(Math.round(drive / quantum) * quantum + 0, 3);
  const rows = fit.per_drive.map((one) => [rounded(one.drive), significant(one.rmse_n, 3), percent(one.nrmse), String(one.samples)]);
  const floor = significant(fit.noise_floor_n, 3);
  return table(`Force error by drive; noise floor ${floor} N`, [`Drive [${unit}]`, "RMSE [N]", "NRMSE", "Samples"], rows);
}

/** Parameters of the modified Bouc-Wen law with 95 % intervals. */
export function makeParameterTable(fit) {
  const rows = Object.entries(fit.parameters).map(([name, { value, unit, ci95, note }]) => [
    name.replaceAll("_", " "), significant(value), ci95 ? `${significant(ci95[0])} … ${significant(ci95[1])}` : "not determined",
    unit === "1" ? "–" : unit, note,
  ]);
  return table("Parameters of the modified Bouc-Wen law", ["Parameter", "Value", "95 % interval", "Unit", "Note"], rows);
}

const percent = (share) => (share === null ? "–" : `${significant(100 * share, 3)} %`);

/** Table with a caption; the first cell of each row is its name. */
export function table(title, heads, rows) {
  const row = ([first, ...others]) => element("tr", {},
    element("th", { scope: "row" }, first), ...others.map((content) => element("td", { className: "number" }, content)));
  return element("div", { className: "scroll", tabIndex: 0, role: "group", "aria-label": title },
    element("table", {},
      element("caption", {}, title),
      element("thead", {}, element("tr", {}, ...heads.map((text) => element("th", { scope: "col" }, text)))),
      element("tbody", {}, ...rows.map(row))));
}

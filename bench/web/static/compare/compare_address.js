// Address of a comparison: runs, reference, tolerance and the shown stroke, so that it can be kept and sent.

const TOLERANCE = "10";

/** Reads a comparison from the query of an address; a run that is named twice counts once. */
export function readComparison(query) {
  return {
    runs: [...new Set(query.getAll("run"))],
    reference: query.get("reference") ?? "",
    tolerance: query.get("tolerance") || TOLERANCE,
    stroke: query.get("stroke") ?? "",
  };
}

/** Address of a comparison in the page; what is not chosen is absent. */
export function compareAddress({ runs, reference = "", tolerance = TOLERANCE, stroke = "" }) {
  const query = new URLSearchParams(runs.map((id) => ["run", id]));
  if (reference) query.set("reference", reference);
  if (reference && tolerance !== TOLERANCE) query.set("tolerance", tolerance);
  if (stroke) query.set("stroke", stroke);
  return `#/compare?${query}`;
}

/** Path of the same comparison at the service. */
export function comparisonPath({ runs, reference, tolerance }) {
  const query = new URLSearchParams(runs.map((id) => ["run", id]));
  if (reference) query.set("reference", reference);
  query.set("tolerance_percent", tolerance);
  return `comparisons?${query}`;
}

/** Address of the list of the runs in which some are selected. */
export const selectionAddress = (runs) => `#/runs?${new URLSearchParams(runs.map((id) => ["compare", id]))}`;

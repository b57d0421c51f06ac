// Fits drifts and finds outliers with the functions of the page, and prints the results as JSON:
//   node fit_drift.mjs DRIFT.js < [{"points": [{"x", "value", "ci95"}], "start": null}]

import { readFileSync } from "node:fs";

// Read as text, because a file without a package beside it has no type of module in older versions of Node.
const source = readFileSync(process.argv[2], "utf8");
const { findOutliers, fitLine, shareWithin } = await import(`data:text/javascript,${encodeURIComponent(source)}`);
const answers = JSON.parse(readFileSync(0, "utf8")).map(({ points, start, t, freedom }) =>
  (t === undefined ? { line: fitLine(points, start ?? undefined), outliers: findOutliers(points, start ?? undefined) } : shareWithin(t, freedom)));
console.log(JSON.stringify(answers));

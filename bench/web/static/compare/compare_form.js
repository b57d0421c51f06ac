// Choice of the runs, the reference and the tolerance of a comparison.

import { compareAddress, selectionAddress } from "./compare_address.js";
import { element } from "../common/format.js";
import { runAddress } from "../common/router.js";
import { describeRun, makeSwatch } from "./run_styles.js";

/** List of the runs with links to them; each can be removed as long as two others remain. */
export function makeRunList(runs, wanted) {
  const remove = (run, name) => element("a", { className: "button", href: withoutRun(wanted, run), "aria-label": `Remove ${name}` }, "Remove");
  const item = (run, place) => {
    const name = describeRun(run, place);
    const link = element("a", { href: runAddress(run.run) }, name);
    return element("li", {}, makeSwatch(place), link, runs.length > 2 ? remove(run.run, name) : null);
  };
  const choose = element("a", { className: "button", href: selectionAddress(wanted.runs) }, "Choose other runs");
  return [element("ul", { className: "legend compared" }, ...runs.map(item)), element("p", { className: "actions" }, choose)];
}

function withoutRun(wanted, id) {
  const reference = wanted.reference === id ? "" : wanted.reference;
  return compareAddress({ ...wanted, reference, runs: wanted.runs.filter((one) => one !== id) });
}

/** Fields for reference and tolerance; calls a function with each valid change. */
export function makeReferenceForm(runs, { reference, tolerance }, onChange) {
  const choice = (value, text) => element("option", { value, selected: value === reference }, text);
  const run = element("select", {}, choice("", "No reference"), ...runs.map((one, place) => choice(one.run, describeRun(one, place))));
  const share = element("input", { type: "number", min: 0.01, max: 100, step: "any", value: tolerance, required: true });
  const form = element("form", { className: "reference", "aria-label": "Reference and tolerance" },
    element("label", {}, "Reference run ", run), element("label", {}, "Tolerance [% of its peak force] ", share));
  const change = () => form.reportValidity() && onChange({ reference: run.value, tolerance: share.value });
  form.addEventListener("change", change);
  form.addEventListener("submit", (event) => event.preventDefault()); // Enter has changed the field already
  return form;
}

// Choice of the units of force and length, kept in this browser.

import { byId } from "./format.js";
import { chooseUnits, chosenUnits } from "./quantities.js";

/** Connects the two fields, and calls a function after each change. */
export function offerUnits(onChanged) {
  for (const [name, unit] of Object.entries(chosenUnits())) {
    const field = byId(`unit-${name}`);
    field.value = unit;
    field.addEventListener("change", () => {
      chooseUnits({ [name]: field.value });
      onChanged();
    });
  }
}

// Dialogs beside the page instead of above it: the bar with Stop stays usable while one is open.

import { byId } from "./format.js";

/** Opens a dialog without making the rest of the page inert; its answer is empty until a button gives one. */
export function openDialog(id) {
  const dialog = byId(id);
  if (dialog.open) return;
  dialog.returnValue = "";
  dialog.show();
}

/** Calls a function when a dialog is closed with the given answer. */
export function onAnswer(id, answer, act) {
  byId(id).addEventListener("close", () => byId(id).returnValue === answer && act());
}

/** Closes the open dialogs that a person may leave without an answer; returns whether there was one. */
export function leaveDialogs() {
  const open = [...document.querySelectorAll("dialog[open]:not([data-required])")];
  for (const dialog of open) dialog.close("");
  return open.length > 0;
}

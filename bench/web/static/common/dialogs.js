// Dialogs beside the page instead of above it: the bar with Stop stays usable while one is open.

import { byId, element, write } from "./format.js";

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

/**
 * Asks a question, and returns whether the person agreed. A question that is open already stays, and the new one is not asked.
 *
 * `texts` are paragraphs that say what will happen; `action` is the word on the button that agrees.
 */
export function ask({ title, texts, action }) {
  const dialog = byId("question-dialog");
  if (dialog.open) return Promise.resolve(false);
  write(byId("question-title"), title);
  byId("question-texts").replaceChildren(...texts.map((text) => element("p", {}, text)));
  write(byId("question-agree"), action);
  openDialog("question-dialog");
  return new Promise((resolve) => {
    dialog.addEventListener("close", () => resolve(dialog.returnValue === "agree"), { once: true });
  });
}

/** Closes the open dialogs that a person may leave without an answer; returns whether there was one. */
export function leaveDialogs() {
  const open = [...document.querySelectorAll("dialog[open]:not([data-required])")];
  for (const dialog of open) dialog.close("");
  return open.length > 0;
}

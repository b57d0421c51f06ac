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
export const ask = ({ title, texts, action }) => openQuestion(title, texts.map((text) => element("p", {}, text)), action);

/** Asks a question that needs a text, with the label of its field. Returns the text; empty if the person did not agree. */
export async function askForText({ title, texts, label, action, maxLength = 500 }) {
  const input = element("input", { autocomplete: "off", required: true, maxLength, pattern: ".*\\S.*", title: "Some words" });
  // Enter would press the first button of the form, which cancels.
  input.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    byId("question-agree").click();
  });
  const field = element("p", { className: "field" }, element("label", {}, label, input));
  const agreed = openQuestion(title, [...texts.map((text) => element("p", {}, text)), field], action);
  input.focus();
  return (await agreed) ? input.value.trim() : "";
}

function openQuestion(title, content, action) {
  const dialog = byId("question-dialog");
  if (dialog.open) return Promise.resolve(false);
  write(byId("question-title"), title);
  byId("question-texts").replaceChildren(...content);
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

// Dialog in which a person signs in again for the signature of one report.

import { post } from "../common/api.js";
import { openDialog } from "../common/dialogs.js";
import { byId, element, write } from "../common/format.js";
import { signedIn } from "../common/session.js";

const ID = "sign-report-dialog";
const CHOICES = { reviewed: "I have reviewed this report", approved: "I approve this report", author: "I am the author of this report" };

/**
 * Opens the dialog. It stays open until the service agrees.
 *
 * `path` is that of the run or campaign, `copy` the report that the service keeps, and `what` says which it is.
 * `onSigned` receives the signature.
 */
export function openSignDialog({ path, what, copy, onSigned }) {
  if (byId(ID)) return;
  const { person } = signedIn();
  const meaning = element("select", { id: "sign-meaning" }, ...Object.entries(CHOICES).map(([value, text]) => element("option", { value }, text)));
  const password = element("input", { id: "sign-password", type: "password", autocomplete: "current-password", required: true, maxLength: 1000 });
  const note = element("p", { className: "note problem", role: "alert" });
  const cancel = element("button", { type: "button" }, "Cancel");
  const form = element("form", {},
    element("h2", { id: "sign-report-title" }, "Sign this report?"),
    element("p", {}, `${what}.`), element("p", { className: "path" }, `SHA-256 ${copy.sha256}`),
    element("p", {}, `You sign as ${person.full_name}. Name, time, meaning and SHA-256 are recorded in the audit trail, and cannot be taken back.`),
    element("input", { type: "text", autocomplete: "username", value: person.name, hidden: true }),
    element("p", { className: "field" }, element("label", { htmlFor: meaning.id }, "Meaning"), meaning),
    element("p", { className: "field" }, element("label", { htmlFor: password.id }, "Your password"), password),
    note, element("p", { className: "buttons" }, cancel, element("button", { className: "primary" }, "Sign")));
  const dialog = element("dialog", { id: ID, "aria-labelledby": "sign-report-title" }, form);
  cancel.addEventListener("click", () => dialog.close(""));
  dialog.addEventListener("close", () => dialog.remove());
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    try {
      const made = await post(`${path}/report/signatures`, { sha256: copy.sha256, meaning: meaning.value, password: password.value });
      dialog.close("done");
      onSigned(made);
    } catch (problem) {
      password.value = "";
      write(note, problem.after("Not signed"));
      password.focus();
    }
  });
  document.body.append(dialog);
  openDialog(ID);
  meaning.focus();
}

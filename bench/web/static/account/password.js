// Dialog for a new password: one's own, with the present one, or that of another person.

import { patch } from "../common/api.js";
import { openDialog } from "../common/dialogs.js";
import { byId, write } from "../common/format.js";

/** Least number of characters, which the service checks as well. */
export const LEAST_CHARACTERS = 12;

export class PasswordDialog {
  /** Takes a function that is called after a change with the person as the service returns it. */
  constructor({ onChanged = () => {} } = {}) {
    this.onChanged = onChanged;
    byId("password-cancel").addEventListener("click", () => byId("password-dialog").close(""));
    byId("password-dialog").addEventListener("close", () => this.clear());
    byId("password-form").addEventListener("submit", (event) => {
      event.preventDefault(); // the dialog stays open until the service agrees
      if (this.isMine) this.save();
    });
  }

  /** True if this object has opened the dialog, which the account and the list of people share. */
  get isMine() {
    return PasswordDialog.user === this;
  }

  open(person, { isOwn }) {
    if (byId("password-dialog").open) return;
    PasswordDialog.user = this;
    Object.assign(this, { person, isOwn });
    write(byId("password-title"), isOwn ? "Change my password" : `Set the password of ${person.full_name || person.name}`);
    byId("password-present").hidden = !isOwn;
    byId("current-password").disabled = !isOwn;
    byId("password-user").value = person.name; // for the password manager of the browser
    openDialog("password-dialog");
    byId(isOwn ? "current-password" : "new-password").focus();
  }

  clear() {
    byId("password-form").reset();
    write(byId("password-note"), "");
  }

  async save() {
    const [present, next, again] = ["current-password", "new-password", "repeated-password"].map((id) => byId(id).value);
    if (next !== again) return write(byId("password-note"), "Not saved: the two new passwords differ.");
    try {
      const change = { password: next, ...(this.isOwn && { current_password: present }) };
      const changed = await patch(`users/${encodeURIComponent(this.person.name)}`, change);
      byId("password-dialog").close("done");
      this.onChanged(changed);
    } catch (problem) {
      write(byId("password-note"), problem.after("Not saved"));
    }
  }
}

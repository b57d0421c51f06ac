// Who is signed in, and the menu of what this person may do with the sign-in.

import { signOut } from "../common/api.js";
import { DeviceCode } from "./device_code.js";
import { byId, write } from "../common/format.js";
import { Menu } from "./menu.js";
import { PasswordDialog } from "./password.js";
import { signedIn } from "../common/session.js";

export class Account {
  /** Takes a function that shows why something was not done. */
  constructor({ onProblem }) {
    this.onProblem = onProblem;
    this.menu = new Menu(byId("account"), byId("account-menu"));
    const device = new DeviceCode();
    const password = new PasswordDialog();
    byId("account-device").addEventListener("click", () => device.open());
    byId("account-password").addEventListener("click", () => password.open(signedIn().person, { isOwn: true }));
    byId("sign-out").addEventListener("click", () => this.signOut());
    document.addEventListener("session", () => this.show());
  }

  show() {
    const session = signedIn();
    byId("account").disabled = !session;
    write(byId("account-name"), session?.person.full_name ?? "Not signed in");
    write(byId("account-role"), session?.person.role ?? "");
    byId("account-password").hidden = session?.kind !== "user"; // a token has no password
  }

  /** Ends the session, and loads the page again, so that nothing of this person stays in its memory. */
  async signOut() {
    try {
      await signOut();
      location.reload();
    } catch (problem) {
      this.onProblem(problem.after("Not signed out"));
    }
  }
}

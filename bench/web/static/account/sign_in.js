// Sign-in: by name and password, by a code that another device shows, or by a token. The address is kept meanwhile.

import { signIn } from "../common/api.js";
import { Countdown } from "./countdown.js";
import { openDialog } from "../common/dialogs.js";
import { byId, duration, write } from "../common/format.js";
import { addSignInWays } from "../common/sign_in_ways.js";

const DIALOG = "sign-in-dialog";

/** True while the page asks to sign in. */
export const isAsking = () => byId(DIALOG).open;

/** Takes a token or a code out of the address, so that no bookmark or screenshot contains it; null without one. */
export function takeCredentials() {
  const given = new URLSearchParams(location.hash.slice(1));
  const way = ["token", "code"].find((one) => given.get(one));
  if (!way) return null;
  history.replaceState(null, "", location.pathname + location.search);
  return { [way]: given.get(way) };
}

export class SignIn {
  /** Takes a function that is called when a person has signed in. */
  constructor({ onSignedIn }) {
    this.onSignedIn = onSignedIn;
    this.wait = new Countdown({
      onTick: (left) => this.showWait(left),
      onEnd: () => this.showWait(0),
    });
    byId("sign-in-form").addEventListener("change", () => this.showWay());
    byId("sign-in-form").addEventListener("submit", (event) => {
      event.preventDefault(); // the dialog stays open until the service agrees
      this.submit();
    });
    this.showWay();
  }

  get way() {
    return byId("sign-in-form").elements.way.value;
  }

  /** Opens the dialog with a sentence why; an open one stays as it is. */
  ask(reason) {
    if (isAsking()) return;
    this.showReason(reason);
    openDialog(DIALOG);
    addSignInWays(byId("sign-in-provider"));
    this.showWay();
  }

  showReason(reason) {
    write(byId("sign-in-reason"), reason);
  }

  /** Shows the fields of the chosen way; the others are not asked for. */
  showWay() {
    for (const part of document.querySelectorAll("#sign-in-form [data-way]")) {
      part.hidden = part.dataset.way !== this.way;
      for (const field of part.querySelectorAll("input")) field.disabled = part.hidden;
    }
  }

  read() {
    const { "sign-in-name": name, password, code, token } = byId("sign-in-form").elements;
    if (this.way === "code") return { code: code.value.replace(/\D/g, "") };
    if (this.way === "token") return { token: token.value.trim() };
    return { name: name.value.trim(), password: password.value };
  }

  submit() {
    return this.attempt(this.read());
  }

  /** Sends credentials; secrets do not stay in the fields. */
  async attempt(credentials) {
    byId("sign-in").disabled = true;
    try {
      await signIn(credentials);
      byId("sign-in-form").reset();
      this.showWay();
      byId(DIALOG).close("done");
      this.onSignedIn();
    } catch (problem) {
      this.ask("");
      this.showReason(problem.after("Not signed in"));
      for (const field of document.querySelectorAll("#sign-in-form input[type=password]")) field.value = "";
      if (problem.retryAfter) this.wait.begin(problem.retryAfter);
    } finally {
      byId("sign-in").disabled = this.wait.isRunning;
    }
  }

  /** Shows the time until the next attempt, which a screen reader does not repeat each second. */
  showWait(left) {
    write(byId("sign-in-wait"), left ? `Next attempt in ${duration(left)}.` : "");
    byId("sign-in").disabled = left > 0;
    if (!left) this.showReason("");
  }
}

// Tokens for programs: list with state and end, creation, revocation. A new token is shown once.

import { get, post, remove } from "../common/api.js";
import { ask } from "../common/dialogs.js";
import { byId, element, instant, localTime, write, zone } from "../common/format.js";
import { ROLES, has } from "../common/rights.js";
import { signedIn } from "../common/session.js";

const MARKS = { valid: "good", expired: "plain", revoked: "bad" };

export class TokenView {
  constructor() {
    byId("token-create").addEventListener("submit", (event) => {
      event.preventDefault();
      this.create();
    });
    byId("token-copy").addEventListener("click", () => copy(byId("new-token")));
    byId("token-hide").addEventListener("click", () => this.hide());
    addEventListener("hashchange", () => this.hide());
  }

  show() {
    const roles = has("administer") ? ROLES : ROLES.slice(0, ROLES.indexOf(signedIn()?.person.role) + 1);
    const chosen = byId("token-role").value || "viewer";
    byId("token-role").replaceChildren(...roles.map((role) => element("option", { selected: role === chosen }, role)));
    write(byId("tokens-zone"), `(${zone()})`);
    return this.load("");
  }

  async load(answer) {
    try {
      const { items } = await get("tokens");
      byId("tokens").replaceChildren(...items.map((token) => this.row(token)));
      write(byId("tokens-note"), answer || (items.length ? "" : "No tokens yet."));
    } catch (problem) {
      write(byId("tokens-note"), problem.after("The tokens cannot be listed"));
    }
  }

  row(token) {
    const { label, role, state, created, created_by: creator, expires, last_used: used } = token;
    return element("tr", {},
      element("th", { scope: "row" }, label, element("small", {}, `by ${creator}, ${localTime(created)}`)),
      element("td", {}, role),
      element("td", {}, element("span", { className: `mark ${MARKS[state] ?? "plain"}` }, state)),
      element("td", { className: "number" }, localTime(expires)),
      element("td", { className: "number" }, used ? localTime(used) : "never"),
      element("td", { className: "actions" }, state === "valid" ? this.makeRevoke(token) : null));
  }

  makeRevoke(token) {
    const button = element("button", { type: "button", "aria-label": `Revoke ${token.label}` }, "Revoke …");
    button.addEventListener("click", () => this.revoke(token));
    return button;
  }

  async create() {
    const [label, role, days] = [byId("token-label").value.trim(), byId("token-role").value, byId("token-days").valueAsNumber];
    try {
      const made = await post("tokens", { label, role, expires_in_days: days });
      byId("token-label").value = "";
      this.hide();
      await this.load(`The token “${made.label}” is valid until ${instant(made.expires)}.`);
      this.reveal(made);
    } catch (problem) {
      write(byId("tokens-note"), problem.after("No token was created"));
    }
  }

  /** Shows a new token, which the service tells only once. */
  reveal({ label, token }) {
    write(byId("new-token-title"), `New token “${label}”`);
    byId("new-token").value = token;
    byId("token-new").hidden = false;
    byId("token-copy").focus();
  }

  hide() {
    byId("new-token").value = "";
    byId("token-new").hidden = true;
    write(byId("token-copied"), "");
  }

  async revoke({ id, label }) {
    const texts = [`Programs that use the token “${label}” are refused at once. This cannot be undone.`];
    if (!(await ask({ title: "Revoke this token?", texts, action: "Revoke" }))) return;
    try {
      await remove(`tokens/${encodeURIComponent(id)}`);
      await this.load(`The token “${label}” was revoked.`);
    } catch (problem) {
      write(byId("tokens-note"), problem.after("Not revoked"));
    }
  }
}

/** Copies a field. Without TLS a browser offers no clipboard to a page; then the text is selected for the person. */
async function copy(field) {
  field.select();
  try {
    await navigator.clipboard.writeText(field.value);
    write(byId("token-copied"), "The token was copied.");
  } catch {
    write(byId("token-copied"), "This browser does not permit it; the token is selected: copy it with Ctrl+C.");
  }
}

// List of the people who may sign in, with their roles, and the actions of an administrator on them.

import { get, patch, remove } from "../common/api.js";
import { ask } from "../common/dialogs.js";
import { byId, element, instant, localTime, write, zone } from "../common/format.js";
import { PasswordDialog } from "./password.js";
import { PersonDialog } from "./person_form.js";
import { need } from "../common/rights.js";

export class PeopleView {
  constructor() {
    this.form = new PersonDialog({ onSaved: (person, words) => this.load(`${nameOf(person)} was ${words}.`) });
    this.password = new PasswordDialog({ onChanged: (person) => this.load(`The password of ${nameOf(person)} was set.`) });
    byId("add-person").addEventListener("click", () => this.form.open());
  }

  show() {
    write(byId("people-zone"), `(${zone()})`);
    return this.load("");
  }

  /** Lists the people again, and shows the answer to the latest action. */
  async load(answer) {
    try {
      const { items } = await get("users");
      this.list(items);
      write(byId("people-note"), answer || (items.length ? "" : "Nobody has been added yet."));
    } catch (problem) {
      byId("people").replaceChildren();
      write(byId("people-note"), problem.after("The people cannot be listed"));
    }
  }

  /** Writes the rows; the focus stays on the same button. */
  list(people) {
    const focused = document.activeElement?.dataset?.key;
    byId("people").replaceChildren(...people.map((person) => this.row(person)));
    if (focused) byId("people").querySelector(`[data-key="${CSS.escape(focused)}"]`)?.focus();
  }

  row(person) {
    const { name, full_name: fullName, role, extra_rights: extra, last_seen: seen } = person;
    return element("tr", {},
      element("th", { scope: "row" }, fullName || name, element("small", {}, person.external ? `${name}, of the identity provider` : name)),
      element("td", {}, role, element("small", {}, extra.length ? `also ${extra.join(", ")}` : "")),
      element("td", {}, ...describeState(person)),
      element("td", { className: "number" }, seen ? localTime(seen) : "never"),
      element("td", { className: "actions" }, ...this.buttons(person)));
  }

  buttons(person) {
    const make = (text, act) => {
      const button = element("button", { type: "button", "aria-label": `${text} ${nameOf(person)}` }, text);
      button.dataset.key = `${person.name}/${text}`;
      button.addEventListener("click", act);
      return need("administer", button);
    };
    return [
      make("Change …", () => this.form.open(person)),
      ...(person.external ? [] : [make("Set password …", () => this.password.open(person, { isOwn: false }))]),
      person.disabled ? make("Enable", () => this.setDisabled(person, false)) : make("Disable …", () => this.disable(person)),
      make("Remove …", () => this.remove(person)),
    ];
  }

  async disable(person) {
    const texts = [`${nameOf(person)} is signed out everywhere and cannot sign in. What this person has done stays recorded.`];
    if (await ask({ title: "Disable this person?", texts, action: "Disable" })) await this.setDisabled(person, true);
  }

  setDisabled(person, disabled) {
    const path = `users/${encodeURIComponent(person.name)}`;
    return this.attempt(() => patch(path, { disabled }), `${nameOf(person)} was ${disabled ? "disabled" : "enabled"}.`);
  }

  async remove(person) {
    const texts = [`${nameOf(person)} is signed out everywhere and leaves the list, and the tokens of this person are revoked.`,
      "What this person has done stays recorded. Disable is enough if the person may come back."];
    if (!(await ask({ title: "Remove this person?", texts, action: "Remove" }))) return;
    await this.attempt(() => remove(`users/${encodeURIComponent(person.name)}`), `${nameOf(person)} was removed.`);
  }

  async attempt(act, done) {
    try {
      await act();
      await this.load(done);
    } catch (problem) {
      write(byId("people-note"), problem.after("Nothing was changed"));
    }
  }
}

const nameOf = ({ name, full_name: fullName }) => fullName || name;

/** Whether a person can sign in now, with the reason why not. */
function describeState({ disabled, external, has_password: hasPassword, locked_until: locked }) {
  const mark = (kind, text) => element("span", { className: `mark ${kind}` }, text);
  if (disabled) return [mark("bad", "disabled")];
  if (external) return [mark("good", "may sign in"), element("small", {}, "by the identity provider only")];
  if (locked) return [mark("fair", "locked"), element("small", {}, `until ${instant(locked)}, after failed sign-ins`)];
  if (!hasPassword) return [mark("fair", "no password"), element("small", {}, "set one, so that this person can sign in")];
  return [mark("good", "may sign in")];
}

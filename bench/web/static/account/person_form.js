// Dialog that adds a person, or changes name, role and extra rights of one.

import { patch, post } from "../common/api.js";
import { openDialog } from "../common/dialogs.js";
import { byId, element, write } from "../common/format.js";
import { RIGHTS, ROLES, rolesWith } from "../common/rights.js";

export class PersonDialog {
  /** Takes a function that receives the saved person, and in a word what was done. */
  constructor({ onSaved }) {
    this.onSaved = onSaved;
    byId("person-role").replaceChildren(...ROLES.map((role) => element("option", {}, role)));
    byId("person-role").addEventListener("change", () => this.offerRights(this.readRights()));
    byId("person-cancel").addEventListener("click", () => byId("person-dialog").close(""));
    byId("person-form").addEventListener("submit", (event) => {
      event.preventDefault(); // the dialog stays open until the service agrees
      this.save();
    });
  }

  /** Opens the dialog for a person of the list, or for a new one. */
  open(person = null) {
    if (byId("person-dialog").open) return;
    this.person = person;
    byId("person-form").reset();
    write(byId("person-note"), "");
    write(byId("person-title"), person ? `Change ${person.full_name || person.name}` : "Add a person");
    for (const part of document.querySelectorAll("#person-form [data-new]")) {
      part.hidden = person !== null;
      part.querySelector("input").disabled = part.hidden;
    }
    this.isExternal = person?.external ?? false;
    byId("person-external").hidden = !this.isExternal;
    for (const part of document.querySelectorAll("#person-form [data-local]")) {
      part.hidden = this.isExternal;
      part.querySelector("input, select").disabled = part.hidden;
    }
    byId("person-full-name").value = person?.full_name ?? "";
    byId("person-role").value = person?.role ?? "technician";
    this.offerRights(person?.extra_rights ?? []);
    openDialog("person-dialog");
    const first = this.isExternal ? document.querySelector("#person-rights input") ?? byId("person-cancel") : byId(person ? "person-full-name" : "person-name");
    first.focus();
  }

  /** Offers the rights that the chosen role does not contain. */
  offerRights(chosen) {
    const role = byId("person-role").value;
    const further = Object.keys(RIGHTS).filter((right) => !rolesWith(right).includes(role));
    byId("person-rights").replaceChildren(
      element("legend", {}, "Rights beyond the role"),
      ...further.map((right) => element("label", { className: "check" },
        element("input", { type: "checkbox", name: "right", value: right, checked: chosen.includes(right) }), RIGHTS[right][0])),
      further.length ? "" : element("p", { className: "soft" }, "This role has all rights."));
  }

  readRights() {
    return [...document.querySelectorAll("#person-rights input:checked")].map(({ value }) => value);
  }

  /** What the identity provider gives of its own persons. */
  readLocal() {
    return { full_name: byId("person-full-name").value.trim(), role: byId("person-role").value };
  }

  async save() {
    const facts = { ...(this.isExternal ? {} : this.readLocal()), extra_rights: this.readRights() };
    try {
      const saved = await this.send(facts);
      byId("person-dialog").close("done");
      byId("person-form").reset();
      this.onSaved(saved, this.person ? "changed" : "added");
    } catch (problem) {
      write(byId("person-note"), problem.after("Not saved"));
    }
  }

  send(facts) {
    if (this.person) return patch(`users/${encodeURIComponent(this.person.name)}`, facts);
    return post("users", { name: byId("person-name").value.trim(), password: byId("person-password").value, ...facts });
  }
}

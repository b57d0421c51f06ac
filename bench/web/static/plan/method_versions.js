// Versions of a method with their approvals, and the buttons of those who may approve.

import { get, post, remove } from "../common/api.js";
import { ask } from "../common/dialogs.js";
import { element, instant, write } from "../common/format.js";
import { need } from "../common/rights.js";
import { table } from "../common/tables.js";

export class MethodVersions {
  /** Takes the name of the method; `section` is filled by `load`. */
  constructor(name) {
    this.name = name;
    this.path = `methods/${encodeURIComponent(name)}`;
    this.list = element("div");
    this.answer = element("p", { className: "note", role: "status" });
    const words = "An approval belongs to the content of a version. A campaign with “methods: approved” is refused while one of its methods is "
      + "not approved; the refusal names it.";
    this.section = element("div", { role: "group", "aria-label": "Versions and approval" },
      element("h3", {}, "Versions and approval"), element("p", { className: "soft" }, words), this.list, this.answer);
  }

  async load() {
    try {
      const { items } = await get(`${this.path}/versions`);
      this.list.replaceChildren(table("Versions, the newest first", ["Version", "Stored", "Approval", "Action"], items.map((one) => this.row(one))));
    } catch (problem) {
      write(this.answer, problem.after("The versions cannot be listed"));
    }
  }

  row(one) {
    const { version, created, approved, approved_by: person } = one;
    const mark = element("span", { className: `mark ${approved ? "good" : "plain"}` }, approved ? "approved" : "not approved");
    const by = approved ? element("small", {}, `by ${person}, ${instant(approved)}`) : "";
    return [`version ${version}`, created ? instant(created) : "included in mrbench", [mark, by], this.makeButton(one)];
  }

  makeButton(one) {
    const text = one.approved ? "Withdraw the approval …" : "Approve …";
    const button = element("button", { type: "button", "aria-label": `${text} version ${one.version} of ${this.name}` }, text);
    button.addEventListener("click", () => (one.approved ? this.withdraw(one) : this.approve(one)));
    return need("approve_methods", button);
  }

  async approve({ version, sha256 }) {
    const texts = [`Campaigns that require approved methods may then run version ${version} of ${this.name}.`,
      "The approval is recorded with your name. A changed method is another version, and is not approved.", `SHA-256 ${sha256}`];
    if (!(await ask({ title: "Approve this version?", texts, action: "Approve" }))) return;
    await this.attempt(() => post(this.approvalOf(version)), `Version ${version} was approved.`);
  }

  async withdraw({ version }) {
    const texts = [`Campaigns that require approved methods are then refused with version ${version} of ${this.name}.`,
      "Campaigns in progress keep their methods."];
    if (!(await ask({ title: "Withdraw the approval?", texts, action: "Withdraw" }))) return;
    await this.attempt(() => remove(this.approvalOf(version)), `The approval of version ${version} was withdrawn.`);
  }

  approvalOf(version) {
    return `${this.path}/${version}/approval`;
  }

  async attempt(act, done) {
    try {
      await act();
      await this.load();
      write(this.answer, done);
    } catch (problem) {
      write(this.answer, problem.after("Nothing was changed"));
    }
  }
}

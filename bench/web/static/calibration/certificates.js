// Calibration certificates of the channels: state in words, a form to add and to correct one, withdrawal.

import { get, remove } from "../common/api.js";
import { shownBench } from "../common/bench.js";
import { byId, element, instant, significant, spaced, write } from "../common/format.js";
import { CertificateForm } from "./certificate_form.js";

/** Marks of the states, in the order of the list. */
const STATES = {
  overdue: "bad", due_soon: "fair", valid: "good", not_yet_valid: "plain", superseded: "plain", withdrawn: "plain",
};
/** States in which a certificate may still be corrected or withdrawn. */
const isPresent = ({ state }) => state !== "withdrawn";

export class CertificateView {
  constructor() {
    this.place = byId("certificate-form");
    byId("certificate-add").addEventListener("click", () => this.open());
  }

  /** Loads and lists all certificates. */
  async show() {
    try {
      const { items } = await get("certificates");
      this.list(items);
      write(byId("certificates-note"), items.length ? "" : "No certificates yet. Runs say so in their log.");
    } catch (problem) {
      write(byId("certificates-note"), problem.after("The certificates cannot be listed"));
    }
  }

  list(items) {
    const order = Object.keys(STATES);
    const sorted = items.toSorted((one, two) => order.indexOf(one.state) - order.indexOf(two.state));
    byId("certificates").replaceChildren(...sorted.map((one) => this.makeRow(one)));
  }

  makeRow(view) {
    const { state, due_text: dueText, document: one, withdrawal } = view;
    const withdrawn = withdrawal && `withdrawn ${instant(withdrawal.withdrawn)} by ${withdrawal.withdrawn_by}: ${withdrawal.reason}`;
    return element("tr", {},
      element("th", { scope: "row" }, spaced(one.channel), shownBench() ? element("small", {}, `of ${view.bench}`) : null),
      element("td", {}, element("span", { className: `mark ${STATES[state]}` }, spaced(state)), element("small", {}, withdrawn || shortDue(dueText))),
      element("td", {}, one.number, element("small", {}, one.laboratory), element("small", {}, describeVersion(view))),
      element("td", { className: "number" }, one.date), element("td", { className: "number" }, one.due),
      element("td", { className: "number" }, percent(view.gain_standard_uncertainty), element("small", {}, describeUncertainty(one))),
      element("td", { className: "number" }, percent(view.gain_error), element("small", {}, describeRange(one))),
      element("td", {}, one.standard, element("small", {}, one.note)),
      element("td", {}, ...(isPresent(view) ? this.makeButtons(view) : [])));
  }

  makeButtons(view) {
    const name = `certificate ${view.document.number}`;
    const correct = element("button", { type: "button", "aria-label": `Correct ${name}` }, "Correct …");
    const withdraw = element("button", { type: "button", "aria-label": `Withdraw ${name}` }, "Withdraw …");
    correct.addEventListener("click", () => this.open(view));
    withdraw.addEventListener("click", () => this.askReason(view));
    return [correct, withdraw];
  }

  /** Opens the form for a new certificate, or for the correction of one. */
  open(view = null) {
    const form = new CertificateForm(view, { onStored: (text) => this.close(text), onCancelled: () => this.close("Nothing was changed.") });
    this.place.replaceChildren(form.place);
    write(byId("certificates-answer"), "");
    form.focus();
  }

  async close(text) {
    this.place.replaceChildren();
    byId("certificate-add").focus();
    await this.show();
    write(byId("certificates-answer"), text);
  }

  /** Asks for the reason of a withdrawal in the place of the form. */
  askReason({ id, document: { number, channel } }) {
    const reason = element("input", { name: "reason", required: true, maxLength: 500 });
    const note = element("p", { className: "note", role: "alert" });
    const cancel = element("button", { type: "button" }, "Cancel");
    const form = element("form", { className: "form record-form" },
      element("h2", {}, `Withdraw certificate ${number}`),
      element("p", {}, `It stays in the list with all its versions. No later run has it for the ${spaced(channel)}.`),
      element("label", {}, element("span", {}, "Reason"), reason),
      element("p", { className: "buttons" }, cancel, element("button", { className: "primary" }, "Withdraw")), note);
    cancel.addEventListener("click", () => this.close("Nothing was changed."));
    form.addEventListener("submit", async (event) => {
      event.preventDefault();
      try {
        await remove(`certificates/${encodeURIComponent(id)}?${new URLSearchParams({ reason: reason.value.trim() })}`);
        await this.close(`Certificate ${number} is withdrawn.`);
      } catch (problem) {
        write(note, problem.after("Not withdrawn"));
      }
    });
    this.place.replaceChildren(form);
    write(byId("certificates-answer"), "");
    reason.focus();
  }
}

/** Words on the due date without channel and certificate, which stand beside them. */
const shortDue = (text) => text.replace(/^[^:]*: calibration /, "").replace(/ \(certificate .*$/, "");

const percent = (share) => `${significant(100 * share, 2)} %`;

function describeVersion({ version, created, created_by: author, reason }) {
  return `version ${version} of ${instant(created)} by ${author}${reason && `: ${reason}`}`;
}

function describeUncertainty({ uncertainty: { value, kind, coverage_factor: factor }, unit }) {
  return `${kind === "relative" ? percent(value) : `${significant(value)} ${shown(unit)}`} at k = ${significant(factor)}`;
}

function describeRange({ points, unit }) {
  return `${points.length} points, ${significant(points[0].reference)} to ${significant(points.at(-1).reference)} ${shown(unit)}`;
}

const shown = (unit) => unit.replace("degC", "°C");

// Commands on one campaign: pause, resume, stop, test message, answers, report. Each command is recorded with the name of the person.

import { post, saveFile, start } from "../common/api.js";
import { CampaignQueue } from "./campaign_queue.js";
import { hasEnded } from "./campaign_words.js";
import { openDialog } from "../common/dialogs.js";
import { byId, element, spaced, write } from "../common/format.js";
import { encodePhoto } from "./photo.js";
import { keep, refresh } from "../common/refresh.js";
import { need } from "../common/rights.js";
import { followOperator, keepOperatorName } from "../common/session.js";

const TEST_TIMEOUT_MS = 30_000;
const REPORT_FORMATS = ["html", "pdf"];
const QUESTIONS = {
  pause: ["Pause the campaign?", "A run in progress ends at its next checkpoint. Between two runs the pause begins at once.", ["pause", "Pause"]],
  resume: ["Resume the campaign?", "The next run may begin at once, and the rod moves. No person may be within its reach.", ["resume", "Resume"]],
  stop: ["Stop the campaign?", "It cannot be resumed. “Stop now” also stops the run in progress, in a controlled way.",
    ["stop", "Stop after this run"], ["now", "Stop now"]],
};

export class CampaignActions {
  /** Takes a function that receives a changed campaign. */
  constructor({ onChanged }) {
    this.onChanged = onChanged;
    this.queue = new CampaignQueue({ act: (...given) => this.act(...given), save: (...given) => this.save(...given), who: () => this.who });
    followOperator(byId("campaign-who"), { fixed: true });
    byId("campaign-who").addEventListener("change", () => keepOperatorName(this.who));
    for (const verb of Object.keys(QUESTIONS)) byId(`campaign-${verb}`).addEventListener("click", () => this.ask(verb));
    byId("campaign-test").addEventListener("click", () => this.test());
    for (const format of REPORT_FORMATS) byId(`campaign-report-${format}`).addEventListener("click", () => this.saveReport(format));
    byId("campaign-dialog").addEventListener("close", ({ target }) => this.command(target.returnValue));
    byId("campaign-answer").addEventListener("submit", (event) => {
      event.preventDefault();
      this.answer();
    });
  }

  get who() {
    return byId("campaign-who").value.trim();
  }

  show(campaign) {
    if (campaign.id !== this.campaign?.id) this.note("");
    this.campaign = campaign;
    const { status } = campaign;
    const can = {
      pause: status === "running", resume: ["paused", "pausing"].includes(status), stop: !hasEnded(campaign) && status !== "stopping",
    };
    for (const verb of Object.keys(can)) byId(`campaign-${verb}`).disabled = !can[verb];
    this.showQuestion(campaign);
    this.queue.show(campaign);
  }

  /** Asks before a command; the dialog leaves Stop of the bench usable. */
  ask(verb) {
    const [title, text, ...answers] = QUESTIONS[verb];
    write(byId("campaign-dialog-title"), title);
    write(byId("campaign-dialog-text"), text);
    byId("campaign-dialog-buttons").replaceChildren(
      element("button", { value: "", autofocus: true }, "Cancel"),
      ...answers.map(([value, label], k) => element("button", { value, className: k ? "" : "primary" }, label)));
    openDialog("campaign-dialog");
  }

  command(answer) {
    const { who } = this;
    if (answer === "pause") this.act("Not paused", "pause", { who }, "Pause was requested.");
    if (answer === "resume") this.resume();
    if (answer === "stop") this.act("Not stopped", "stop", { who }, "Stop was requested.");
    if (answer === "now") this.act("Not stopped, use Stop of the bench", "stop", { who, now: true }, "Stop was requested, also of the run in progress.");
  }

  async resume() {
    if (await this.act("Not resumed", "resume", { who: this.who }, "The campaign was resumed.")) byId("stop").focus();
  }

  /** Sends a command or an edit and shows the campaign after it; returns whether it was accepted. */
  async act(failure, verb, body, done, send = post) {
    const { id } = this.campaign;
    this.note("");
    try {
      const changed = await send(`campaigns/${encodeURIComponent(id)}${verb && `/${verb}`}`, body);
      this.onChanged(changed);
      if (id === this.campaign.id) this.note(done);
      return true;
    } catch (problem) {
      if (id === this.campaign.id) this.note(problem.after(failure), true);
      return false;
    }
  }

  async save(path, name) {
    try {
      this.note(`${await saveFile(path, name)} was saved.`);
    } catch (problem) {
      this.note(problem.after("Not saved"), true);
    }
  }

  note(text, isProblem = false) {
    write(byId("campaign-result"), text);
    byId("campaign-result").classList.toggle("problem", isProblem);
  }

  async test() {
    const { id } = this.campaign;
    this.note("The test message is sent …");
    try {
      const { result } = await post(`campaigns/${encodeURIComponent(id)}/test-message`, undefined, TEST_TIMEOUT_MS);
      this.note(result === "sent" ? "The test message was sent to all recipients." : result, result !== "sent");
    } catch (problem) {
      this.note(problem.after("No test message was sent"), true);
    }
  }

  /** Saves the report on the present state; it is made at its request, in some seconds. */
  async saveReport(format) {
    const { id } = this.campaign;
    const answer = (...given) => id === this.campaign.id && this.note(...given);
    answer("The report is made …");
    try {
      answer(`${await saveFile(`campaigns/${encodeURIComponent(id)}/report?format=${format}`)} was saved.`);
    } catch (problem) {
      answer(problem.after("No report was made"), true);
    }
  }

  /** Shows a question with its form; what a person has typed stays while the question is the same. */
  showQuestion({ id, question }) {
    byId("campaign-question").hidden = !question;
    refresh(byId("campaign-answer"), [id, question], () => (question ? makeForm(question, (choice) => this.answer(choice)) : []));
  }

  async answer(choice = null) {
    const form = byId("campaign-answer");
    const photo = form.querySelector("[name=photo]")?.files[0];
    try {
      const body = { who: this.who, note: form.querySelector("[name=note]").value, choice, photo: photo ? await encodePhoto(photo) : "" };
      if (await this.act("Not answered", "answer", body, "The answer was taken.", start)) byId("campaign-question-title").focus();
    } catch (error) {
      this.note(`Not answered: ${error.message}`, true);
    }
  }
}

/** Fields of a prompt, or the choices after a failure. */
function makeForm({ text, needs_note: needsNote, needs_photo: needsPhoto, choices }, choose) {
  const note = element("textarea", { name: "note", rows: 2, maxLength: 2000, required: needsNote });
  const photo = element("input", { name: "photo", type: "file", accept: "image/jpeg,image/png", required: needsPhoto });
  const label = (name, isNeeded, field) => element("label", {}, name, element("span", { className: "soft" }, isNeeded ? " (needed)" : " (optional)"), field);
  const buttons = choices.map((choice) => {
    const button = keep(element("button", { type: "button" }, choice === "stop" ? "Stop the campaign" : `${spaced(choice)} the step`), choice);
    button.addEventListener("click", () => choose(choice));
    return choice === "stop" ? button : need("operate", button);
  });
  return [
    element("p", { className: "reason" }, text), label("Note", needsNote, note),
    choices.length ? null : label("Photo, JPEG or PNG", needsPhoto, photo),
    element("p", { className: "actions" }, ...(buttons.length ? buttons : [need("operate", keep(element("button", { className: "primary" }, "Answer"), "answer"))])),
  ].filter(Boolean);
}

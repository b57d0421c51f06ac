// Queue of a campaign: its steps, and edits while it runs. Each edit is recorded with who made it and when.

import { start } from "../common/api.js";
import { countStates, describeKind, hasEnded, markStep } from "./campaign_words.js";
import { byId, element, instant, write } from "../common/format.js";
import { keep, refresh } from "../common/refresh.js";
import { need } from "../common/rights.js";
import { QUANTITIES } from "../common/quantities.js";

const FIRST = 30;
const ENDED = ["done", "skipped", "failed", "held_back"];
const RELEASABLE = ["held_back", "failed", "skipped"];

export class CampaignQueue {
  /** Takes the functions that send an edit, save a file, and return the name of the person. */
  constructor({ act, save, who }) {
    Object.assign(this, { act, save, who });
    this.showsAll = false;
    byId("queue-all").addEventListener("click", () => {
      this.showsAll = true;
      this.show(this.campaign);
    });
    byId("step-kind").addEventListener("change", () => showFields());
    byId("step-setup").addEventListener("change", () => showFields());
    byId("step-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.add();
    });
    showFields();
  }

  show(campaign) {
    if (campaign.id !== this.campaign?.id) this.showsAll = false;
    this.campaign = campaign;
    const { items } = campaign;
    const open = items.filter(({ state }) => !ENDED.includes(state));
    const shown = this.showsAll ? open : open.slice(0, FIRST);
    byId("queue-all").hidden = shown.length === open.length;
    write(byId("queue-all"), `Show all ${open.length} steps`);
    write(byId("queue-empty"), open.length ? "" : "No step is left.");
    refresh(byId("queue"), [shown, hasEnded(campaign)], () => shown.map((item) => this.row(item)));
    this.showEnded(items.filter(({ state }) => ENDED.includes(state)));
    this.showPlaces(open.filter(({ state }) => state === "pending"));
    byId("step-form").hidden = hasEnded(campaign);
    write(byId("step-position-unit"), QUANTITIES.displacement.unit);
  }

  showEnded(ended) {
    write(byId("ended-count"), ended.length ? countStates(ended.map(({ state }) => state)) : "none");
    refresh(byId("ended-steps"), [ended, hasEnded(this.campaign)], () => ended.toReversed().map((item) => this.row(item)));
  }

  /** Places for a new step: before a pending one, or at the end. */
  showPlaces(pending) {
    const place = byId("step-place");
    const before = place.value;
    refresh(place, pending.map(({ id, label }) => [id, label]), () => [
      element("option", { value: "now" }, "now, between two runs"),
      ...pending.slice(0, 200).map(({ id, label }) => element("option", { value: id }, `before ${id}: ${label}`)),
      element("option", { value: "", selected: true }, "at the end"),
    ]);
    if ([...place.options].some(({ value }) => value === before)) place.value = before;
  }

  row(item) {
    const { id, kind, label, state, reason, note, ended } = item;
    const answer = note ? element("small", {}, `Answer: ${note}`) : null;
    const photo = item.photo ? this.photoButton(item) : null;
    const time = ended ? element("small", { className: "number" }, instant(ended)) : null;
    return element("tr", {},
      element("th", { scope: "row" }, id), element("td", {}, label, element("small", {}, describeKind(kind)), answer, photo),
      element("td", {}, markStep(state), element("small", {}, reason), time),
      element("td", { className: "actions" }, ...(hasEnded(this.campaign) ? [] : this.buttons(item))));
  }

  photoButton({ id, photo }) {
    const button = keep(element("button", { type: "button", "aria-label": `Save photo of step ${id}` }, "Save photo"), `${id}/photo`);
    const path = `campaigns/${encodeURIComponent(this.campaign.id)}/photos/${encodeURIComponent(id)}`;
    button.addEventListener("click", () => this.save(path, photo));
    return button;
  }

  buttons(item) {
    const { id, state } = item;
    const make = (text, edit, done) => {
      const button = keep(element("button", { type: "button", "aria-label": `${text}: step ${id}, ${item.label}` }, text), `${id}/${text}`);
      button.addEventListener("click", () => this.edit(edit(), done));
      return need("operate", button);
    };
    if (RELEASABLE.includes(state)) return [make("Release", () => ({ edit: "release", item: id }), `Step ${id} is tried again.`)];
    if (state !== "pending") return [];
    return [
      make("Earlier", () => this.move(item, -1), `Step ${id} was moved.`),
      make("Later", () => this.move(item, 1), `Step ${id} was moved.`),
      make("Pause before", () => ({ edit: "pause", before: id }), `The campaign pauses before step ${id}.`),
      make("Delete", () => ({ edit: "delete", item: id }), `Step ${id} was deleted; it can be released again.`),
    ];
  }

  move(item, places) {
    const pending = this.campaign.items.filter(({ state }) => state === "pending");
    const index = pending.findIndex(({ id }) => id === item.id);
    return { edit: "move", item: item.id, position: Math.min(Math.max(index + places, 0), pending.length - 1) };
  }

  edit(edit, done) {
    return this.act("Not edited", "", { who: this.who(), edit }, done, (path, body) => start(path, body, "PATCH"));
  }

  add() {
    const kind = byId("step-kind").value;
    const place = byId("step-place").value;
    const step = readStep(kind);
    const added = kind === "pause" && place !== "now" ? { edit: "pause", before: place || null, text: byId("step-text").value }
      : place === "now" ? { edit: "do_now", step } : { edit: "add", steps: [step], before: place || null };
    return this.edit(added, place === "now" ? describeNow(this.campaign) : "The step was added.");
  }
}

/** Says when a step for now is done. */
const describeNow = ({ status }) => `The step is done next${status === "paused" ? "; the campaign stays paused" : ""}.`;

/** Shows the fields of the chosen kind of step, and the target of a move. */
function showFields() {
  const kind = byId("step-kind").value;
  const setup = byId("step-setup").value;
  for (const field of document.querySelectorAll("#step-form [data-kind]")) {
    field.hidden = field.dataset.kind !== kind || (field.dataset.setup ?? setup) !== setup;
    for (const input of field.querySelectorAll("input, select")) input.disabled = field.hidden;
  }
}

function readStep(kind) {
  const value = (id) => byId(id).value.trim();
  if (kind === "rest") return { rest: { seconds: Number(value("step-seconds")) } };
  if (kind === "pause") return { prompt: { text: value("step-text") } };
  if (kind === "setup") return { setup: readSetup(value("step-setup")) };
  const drive = value("step-drive");
  return { run: { specimen: value("step-specimen"), method: value("step-method"), drive: drive === "" ? null : Number(drive) } };
}

/** Setup step of the form; the target of a move is entered in the unit of the page. */
function readSetup(step) {
  return step === "move" ? { step, position_m: byId("step-position").valueAsNumber / QUANTITIES.displacement.scale } : { step };
}

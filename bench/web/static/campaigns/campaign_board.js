// Board of one campaign: state, times, matrix of specimens and methods, trends and messages.

import { CampaignTrends } from "./campaign_trends.js";
import { countStates, describeDrive, describePhase, hasEnded, markStatus, markStep } from "./campaign_words.js";
import { byId, duration, element, fixed, instant, spaced } from "../common/format.js";
import { keep, refresh } from "../common/refresh.js";
import { runAddress } from "../common/router.js";

/** Largest number of steps of one cell that are shown one by one. */
const MAX_STEPS = 6;

export class CampaignBoard {
  constructor() {
    this.trends = new CampaignTrends(byId("campaign-trends"));
  }

  /** Shows a campaign; a part whose facts have not changed stays as it is. */
  show(campaign) {
    const { items, events } = campaign;
    refresh(byId("campaign-facts"), listFacts(campaign), () => makeFacts(campaign));
    refresh(byId("campaign-matrix"), items, () => makeMatrix(items));
    refresh(byId("campaign-messages"), events, () => events.toReversed().map(makeMessage));
    this.trends.show(campaign);
  }
}

function listFacts(campaign) {
  const { status, reason, current, phase, next, waits_for: obstacle, expected_end: end, times, temperature_c: temperature } = campaign;
  const { bench, operator, created, updated } = campaign;
  const step = current ? `${current.id}: ${current.label}` : hasEnded(campaign) ? "none, the campaign has ended" : "none, between two steps";
  return {
    State: { status, reason },
    "Current step": [step, describePhase(phase)],
    "Next step": [next ? `${next.id}: ${next.label}` : "none", obstacle && `It cannot begin yet: ${obstacle}`],
    "Expected end": [end ? instant(end) : "–", end ? "without the time that persons take" : ""],
    "Time in motion": [duration(times.stroking_s), "of complete and incomplete runs"],
    "Time at rest": [duration(times.rest_s)],
    "Time held": [duration(times.held_s), "paused, in setup steps, or waiting for a person, for results or for the bench"],
    Temperature: [temperature === null ? "no reading" : `${fixed(temperature, 1)} °C`],
    Bench: [bench === "agent" ? "this bench" : bench],
    Operator: [operator || "not given"],
    Started: [instant(created)],
    "Latest change": [hasEnded(campaign) || status === "paused" ? instant(updated) : "", bench === "agent" ? "" : "by the simulated clock"],
  };
}

function makeFacts(campaign) {
  const entries = Object.entries(listFacts(campaign)).filter(([, content]) => content.status || content[0]);
  return entries.map(([name, content]) => {
    const [first, more] = content.status ? [markStatus(content), content.reason] : content;
    return element("div", {}, element("dt", {}, name), element("dd", {}, first, more ? element("small", {}, more) : null));
  });
}

/** Matrix of the steps that run a method of their own: a row for each specimen, a column for each method with its drive. */
function makeMatrix(items) {
  const runs = items.filter(({ method }) => method);
  if (!runs.length) return [element("caption", {}, "This campaign has no runs of a method.")];
  const column = ({ method, drive, drive_unit: unit }) => JSON.stringify([method, drive, unit]);
  const columns = [...new Set(runs.map(column))];
  const specimens = [...new Set(runs.map(({ specimen }) => specimen))];
  const heads = columns.map((key) => {
    const [method, drive, unit] = JSON.parse(key);
    return element("th", { scope: "col" }, method, element("small", {}, describeDrive(drive, unit)));
  });
  const rows = specimens.map((specimen) => element("tr", {}, element("th", { scope: "row" }, specimen),
    ...columns.map((key) => makeCell(runs.filter((item) => item.specimen === specimen && column(item) === key)))));
  return [
    element("thead", {}, element("tr", {}, element("th", { scope: "col" }, "Specimen"), ...heads)),
    element("tbody", {}, ...rows),
  ];
}

function makeCell(items) {
  if (!items.length) return element("td", {}, element("span", { className: "soft" }, "not planned"));
  if (items.length <= MAX_STEPS) return element("td", {}, element("ul", { className: "cell" }, ...items.map(makeEntry)));
  const latest = items.findLast(({ runs }) => runs.length);
  const marks = [...new Set(items.map(({ state }) => state))].map((state) => element("li", {}, markStep(state)));
  return element("td", {}, element("ul", { className: "cell" }, ...marks),
    element("small", {}, countStates(items.map(({ state }) => state))), latest ? linkRun(latest, latest.runs.length - 1, "Latest run") : null);
}

function makeEntry(item) {
  const links = item.runs.map((_, k) => linkRun(item, k, item.runs.length > 1 ? `Run ${k + 1}` : "Run"));
  const crashes = item.crashes ? `${item.crashes} crashes of the bench. ` : "";
  const reason = ["failed", "skipped", "held_back"].includes(item.state) ? item.reason : "";
  return element("li", {}, markStep(item.state), ...links, element("small", {}, `${crashes}${reason}`));
}

function linkRun(item, k, text) {
  const link = element("a", { href: runAddress(item.runs[k]), "aria-label": `${text} of step ${item.id}, ${item.label}` }, text);
  return keep(link, `${item.id}/${k}`);
}

function makeMessage({ at, kind, text, who, notifications }) {
  const isUrgent = ["person_needed", "held_back", "failed"].includes(kind);
  return element("li", {},
    element("time", { className: "number", dateTime: at }, instant(at)),
    element("span", { className: isUrgent ? "attention" : "" }, ` ${spaced(kind)}: ${text}`), who ? ` (${who})` : "",
    ...notifications.map((one) => element("small", { className: one.state === "failed" ? "problem" : "" }, describeNotification(one))));
}

/** What has become of the message to one recipient. */
function describeNotification({ recipient, state, attempts, next_attempt: next, reason }) {
  if (state === "sent") return `✔ Sent to ${recipient}.`;
  if (state === "failed") return `✖ Not sent after ${attempts} attempts: ${reason}.`;
  return attempts ? `▲ Attempt ${attempts + 1} follows at ${instant(next)}: ${reason}.` : `○ Message to ${recipient} is due.`;
}

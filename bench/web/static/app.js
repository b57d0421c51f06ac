// The page's parts put together: what the service sends goes to those who show it.

import { forgetToken, get, keepToken, takeToken } from "./api.js";
import { byId, fixed, write } from "./format.js";
import { showEvent, showInstruments, showWarnings } from "./instruments.js";
import { FIELDS, LiveLink, QUANTITIES, Readings, withDriveNamed } from "./live.js";
import { LivePlots, STRIP_SECONDS } from "./plots.js";
import { Preparation } from "./prepare.js";
import { SampleRing } from "./ring.js";
import { RunList } from "./runs.js";
import { StartForm } from "./start.js";
import { TopBar } from "./topbar.js";

/** [s] of silence after which the plain way is tried; the agent speaks four times a second. */
const ASK_AFTER = 0.9;
/** [ms] from one such question to the next: soon while there is hope, seldom once all is silent. */
const ASK_EVERY = { hopeful: 400, stale: 3_000 };

const ring = new SampleRing(FIELDS);
const runs = new RunList({ onSpecimens: (names) => form.suggestSpecimens(names) });
const form = new StartForm({
  onStarted: (run) => {
    runs.take(run);
    byId("stop").focus(); // what was started here can be stopped by the next key
  },
});
const bar = new TopBar({ onState: (state) => form.show({ state }) });
const preparation = new Preparation();
new Readings(ring, byId("readings"), STRIP_SECONDS);
const plots = new LivePlots(ring, QUANTITIES, { loop: byId("plot-loop"), strips: byId("strips") });

let asking = false;
let askedAt = -Infinity;
let driveKind = "";
let sampledAt = -Infinity;

const TAKE = {
  status(status) {
    bar.take(status);
    driveKind = status.drive_kind;
    if (status.drive_unit) plots.nameDrive(`Drive [${status.drive_unit}]`);
    showInstruments(status.instruments);
    showWarnings(status.warnings);
    preparation.take(status);
  },
  samples(samples) {
    if (!samples.time_ns.length) return;
    sampledAt = performance.now();
    ring.push(withDriveNamed(samples, driveKind));
  },
  event: showEvent,
  run: (run) => runs.take(run),
  job: (job) => runs.takeJob(job),
};

const link = new LiveLink({
  onMessage: ({ topic, data }) => TAKE[topic]?.(data),
  onClosed: ask,
  onReopened: () => runs.load(), // what changed meanwhile was not heard
});

/** Asks the agent's state the plain way: it says in words what is wrong when nothing comes live. */
async function ask() {
  if (asking) return;
  asking = true;
  askedAt = performance.now();
  try {
    TAKE.status(await get("agent"));
  } catch (problem) {
    if (problem.refused) askForToken("The service does not take this token.");
    else bar.miss(problem.after("Trying again"));
  } finally {
    asking = false;
  }
}

/** Live values older than a moment are greyed, and their age is said. */
function showAge() {
  const age = (performance.now() - sampledAt) / 1000;
  const live = byId("live");
  live.classList.toggle("stale", age > 1);
  const words = age < 1 ? "" : Number.isFinite(age) ? `no samples for ${fixed(age, 0)} s` : "no samples yet";
  write(byId("live-age"), words);
}

function askForToken(reason) {
  link.close();
  forgetToken();
  write(byId("token-reason"), reason);
  if (!byId("token-dialog").open) byId("token-dialog").showModal();
}

function begin() {
  form.load();
  runs.load();
  link.open();
  ask();
}

byId("token-dialog").addEventListener("cancel", (event) => event.preventDefault());
byId("token-form").addEventListener("submit", () => {
  keepToken(byId("token").value.trim());
  byId("token").value = "";
  begin();
});
setInterval(showAge, 250);
setInterval(() => {
  const due = performance.now() - askedAt > (bar.stale ? ASK_EVERY.stale : ASK_EVERY.hopeful);
  if (due && bar.age > ASK_AFTER && !byId("token-dialog").open) ask();
}, 200);
addEventListener("hashchange", () => location.hash && takeToken() && begin());

if (takeToken()) begin();
else askForToken("");

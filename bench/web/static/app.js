// Entry point: creates the parts of the page and distributes the messages of the service to them.

import { forgetToken, get, keepToken, takeToken } from "./api.js";
import { byId, fixed, write } from "./format.js";
import { showEvent, showInstruments, showWarnings } from "./instruments.js";
import { FIELDS, LiveLink, QUANTITIES, Readings, fillCoilChannel } from "./live.js";
import { LivePlots, STRIP_SECONDS } from "./plots.js";
import { SetupPanel } from "./prepare.js";
import { SampleRing } from "./ring.js";
import { RunList } from "./runs.js";
import { StartForm } from "./start.js";
import { TopBar } from "./topbar.js";

/** Silence [s] after which the status is requested by REST; the agent publishes it four times a second. */
const REQUEST_AFTER = 0.9;
/** Time [ms] between such requests: short at first, long once the connection counts as lost. */
const REQUEST_EVERY = { fresh: 400, stale: 3_000 };

const ring = new SampleRing(FIELDS);
const runs = new RunList({ onSpecimens: (names) => form.suggestSpecimens(names) });
const form = new StartForm({
  onStarted: (run) => {
    runs.update(run);
    byId("stop").focus(); // the next key can stop a run that was started here
  },
});
const bar = new TopBar({ onState: (state) => form.show({ state }) });
const setup = new SetupPanel();
new Readings(ring, byId("readings"), STRIP_SECONDS);
const plots = new LivePlots(ring, QUANTITIES, { loop: byId("plot-loop"), strips: byId("strips") });

let requesting = false;
let requestedAt = -Infinity;
let driveKind = "";
let sampledAt = -Infinity;

const HANDLERS = {
  status(status) {
    bar.update(status);
    driveKind = status.drive_kind;
    if (status.drive_unit) plots.nameDrive(`Drive [${status.drive_unit}]`);
    showInstruments(status.instruments);
    showWarnings(status.warnings);
    setup.update(status);
  },
  samples(samples) {
    if (!samples.time_ns.length) return;
    sampledAt = performance.now();
    ring.push(fillCoilChannel(samples, driveKind));
  },
  event: showEvent,
  run: (run) => runs.update(run),
  job: (job) => runs.updateJob(job),
};

const link = new LiveLink({
  onMessage: ({ topic, data }) => HANDLERS[topic]?.(data),
  onClosed: requestStatus,
  onReopened: () => runs.load(), // changes in the meantime were missed
});

/** Requests the agent's status by REST: its error explains why no live messages arrive. */
async function requestStatus() {
  if (requesting) return;
  requesting = true;
  requestedAt = performance.now();
  try {
    HANDLERS.status(await get("agent"));
  } catch (problem) {
    if (problem.unauthorised) askForToken("The service does not accept this token.");
    else bar.showFailure(problem.after("Trying again"));
  } finally {
    requesting = false;
  }
}

/** Greys live values older than a second, and shows their age. */
function showAge() {
  const age = (performance.now() - sampledAt) / 1000;
  const live = byId("live");
  live.classList.toggle("stale", age > 1);
  const text = age < 1 ? "" : Number.isFinite(age) ? `no samples for ${fixed(age, 0)} s` : "no samples yet";
  write(byId("live-age"), text);
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
  requestStatus();
}

byId("token-dialog").addEventListener("cancel", (event) => event.preventDefault());
byId("token-form").addEventListener("submit", () => {
  keepToken(byId("token").value.trim());
  byId("token").value = "";
  begin();
});
setInterval(showAge, 250);
setInterval(() => {
  const due = performance.now() - requestedAt > (bar.stale ? REQUEST_EVERY.stale : REQUEST_EVERY.fresh);
  if (due && bar.age > REQUEST_AFTER && !byId("token-dialog").open) requestStatus();
}, 200);
addEventListener("hashchange", () => location.hash && takeToken() && begin());

if (takeToken()) begin();
else askForToken("");

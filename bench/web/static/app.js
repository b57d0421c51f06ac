// Entry point: creates the parts of the page and distributes the messages of the service to them.

import { Account } from "./account/account.js";
import { AuditView } from "./account/audit_trail.js";
import { BatchView } from "./batches/batch_view.js";
import { BenchList } from "./bench/bench_list.js";
import { benchPath } from "./common/bench.js";
import { get, readSession } from "./common/api.js";
import { CampaignView } from "./campaigns/campaigns.js";
import { CertificateView } from "./calibration/certificates.js";
import { CheckView } from "./calibration/checks.js";
import { CompareView } from "./compare/compare.js";
import { EventList } from "./bench/events.js";
import { byId, fixed, write } from "./common/format.js";
import { HealthStrip } from "./bench/health.js";
import { JobView } from "./jobs/jobs.js";
import { forgetInstruments, forgetWarnings, showInstruments, showWarnings } from "./bench/instruments.js";
import { Limits } from "./live/limits.js";
import { LiveLink, fillCoilChannel } from "./live/live.js";
import { PlanView } from "./plan/plan.js";
import { Playhead } from "./live/playhead.js";
import { LivePlots, STRIP_SECONDS } from "./live/plots.js";
import { PeopleView } from "./account/people.js";
import { Preparation } from "./bench/prepare.js";
import { FIELDS, QUANTITIES } from "./common/quantities.js";
import { Readings } from "./live/readings.js";
import { watchRights } from "./common/rights.js";
import { SampleRing } from "./live/ring.js";
import { Router } from "./common/router.js";
import { RunView } from "./runs/run.js";
import { RunList } from "./runs/runs.js";
import { RunSearch } from "./runs/run_search.js";
import { ServiceClock } from "./live/service_clock.js";
import { takeSignInProblem } from "./common/sign_in_ways.js";
import { SignIn, isAsking, takeCredentials } from "./account/sign_in.js";
import { SpecimenView } from "./specimens/specimen.js";
import { SpecimenList } from "./specimens/specimens.js";
import { StartForm } from "./bench/start.js";
import { TokenView } from "./account/tokens.js";
import { TopBar } from "./bench/topbar.js";
import { offerUnits } from "./common/units.js";
import { UploadDialog } from "./common/upload.js";

/** Silence [s] after which the status is requested by REST; the agent publishes it four times a second. */
const REQUEST_AFTER = 0.9;
/** Time [ms] between such requests: short at first, long once the connection counts as lost. */
const REQUEST_EVERY = { fresh: 400, stale: 3_000 };
/** Time [ms] after which the page asks again who is signed in, if the service did not answer. */
const ASK_AGAIN_MS = 2_000;

const ring = new SampleRing(FIELDS);
const runView = new RunView({ onRun: (run) => runs.update(run) });
const specimens = new SpecimenList();
const specimen = new SpecimenView();
const runs = new RunList({
  onSpecimens: (names) => form.suggestSpecimens(names),
  onRun: (run) => {
    runView.update(run);
    specimen.update(run);
  },
});
const search = new RunSearch();
const form = new StartForm({
  onStarted: (run) => {
    runs.update(run);
    byId("stop").focus(); // the next key can stop a run that was started here
  },
});
const clock = new ServiceClock();
const bar = new TopBar({
  clock,
  onState: (state) => {
    form.show({ state });
    if (state === "unknown") forgetStatus();
  },
});
const benches = new BenchList({ onProblem: (text) => bar.showDetail(text, true) });
const preparation = new Preparation({ onStatus: (status) => HANDLERS.status(status) });
const health = new HealthStrip();
const events = new EventList();
const plan = new PlanView();
const campaigns = new CampaignView();
const comparison = new CompareView();
const jobs = new JobView({ clock });
const batch = new BatchView();
const people = new PeopleView();
const tokens = new TokenView();
const audit = new AuditView();
const signIn = new SignIn({ onSignedIn: begin });
new Account({ onProblem: (text) => bar.showDetail(text, true) });
watchRights((reason) => bar.showDetail(reason, true));
const certificates = new CertificateView();
const checks = new CheckView({
  onStarted: (run) => {
    runs.update(run);
    byId("stop").focus();
  },
});
new UploadDialog({ onRun: (run) => runs.update(run) });
const limits = new Limits();
new Readings(ring, byId("readings"), STRIP_SECONDS, limits);
const playhead = new Playhead(clock);
const plots = new LivePlots(ring, QUANTITIES, { loops: byId("loops"), strips: byId("strips") }, () => ring.revealUntil(playhead.utc));

const router = new Router({
  bench: ({ query }) => query.has("method") && form.choose(query.get("method")),
  plan: (address) => plan.show(address),
  runs: ({ query }) => {
    runs.selection.read(query);
    runs.search(search.read(query));
  },
  compare: (address) => comparison.show(address),
  jobs: () => jobs.show(),
  batches: (address) => batch.show(address),
  run: (address) => runView.show(address),
  specimens: (address) => specimens.show(address),
  specimen: (address) => specimen.show(address),
  campaigns: (address) => campaigns.show(address),
  people: () => people.show(),
  tokens: () => tokens.show(),
  audit: (address) => audit.show(address),
  calibration: (address) => {
    certificates.show();
    checks.show(address);
  },
});

offerUnits(() => {
  plots.relabel();
  plan.relabel();
  specimen.relabel();
  runView.relabel();
  comparison.relabel();
  batch.relabel();
  checks.list();
});

let requesting = false;
let requestedAt = -Infinity;
let withoutRig = false;
let driveKind = "";

const HANDLERS = {
  clock: ({ utc_s: utc }) => clock.update(utc),
  status(status) {
    bar.update(status);
    limits.update(status);
    driveKind = status.drive_kind;
    if (status.drive_unit && status.drive_unit !== QUANTITIES.drive.unit) {
      QUANTITIES.drive.unit = status.drive_unit;
      plots.relabel();
    }
    form.showDrive(status.drive_kind);
    form.showLastRun(status.run);
    if (bar.stale) return; // a status is true at its own time only
    showInstruments(status.instruments);
    showWarnings(status.warnings);
    health.showStatus(status);
    preparation.update(status);
  },
  event: (event) => events.add(event),
  run: (run) => {
    runs.update(run);
    checks.update(run);
  },
  job: (job) => {
    runs.updateJob(job);
    specimen.updateJob(job);
  },
};

const link = new LiveLink({
  onMessage: ({ topic, data }) => HANDLERS[topic]?.(data),
  onBatch: addBatch,
  onClosed: requestStatus,
  onReopened: () => {
    withoutRig = false; // the service may have been started again with one
    runs.load(); // changes in the meantime were missed
    events.load();
    specimen.reload();
  },
});

function addBatch(batch) {
  clock.update(batch.utc + (batch.count - 1) * batch.period);
  if (ring.written) playhead.observe(ring.origin + ring.latest);
  ring.push(fillCoilChannel(batch, driveKind));
}

/** Shows as not known what comes with a status alone, until the next one arrives. */
function forgetStatus() {
  forgetInstruments();
  forgetWarnings();
  health.forget();
  preparation.forget();
}

/** Requests the agent's status by REST: its error explains why no live messages arrive. */
async function requestStatus() {
  if (requesting) return;
  requesting = true;
  requestedAt = performance.now();
  try {
    HANDLERS.status(await get(benchPath()));
  } catch (problem) {
    withoutRig = problem.hasNoRig;
    if (!problem.unauthorised) bar.showFailure(problem.after(withoutRig ? "No rig" : "Trying again"));
  } finally {
    requesting = false;
  }
}

/** Shows the age of the newest sample in view; live values older than a second are grey. */
function showAge() {
  const age = ring.end ? clock.age(ring.origin + ring.newest) : Infinity;
  const live = byId("live");
  live.classList.toggle("stale", age > 1);
  const text = age < 1 ? `newest sample in view is ${fixed(1e3 * age, 0)} ms old` : Number.isFinite(age) ? `no samples for ${fixed(age, 0)} s` : "no samples yet";
  write(byId("live-age"), text);
}

/** Asks to sign in. The ended session stays until there is another, so that Stop is still attempted with it. */
function askToSignIn(reason) {
  link.close();
  signIn.ask(reason);
}

/** Signs in with what the address contains, or goes on with the session of the cookie. */
async function arrive() {
  const failure = takeSignInProblem();
  const given = takeCredentials();
  if (given) return signIn.attempt(given);
  try {
    await readSession();
    begin();
  } catch (problem) {
    if (problem.unauthorised) return askToSignIn(failure);
    bar.showFailure(problem.after("Trying again"));
    setTimeout(arrive, ASK_AGAIN_MS);
  }
}

async function begin() {
  try {
    await benches.begin(); // all that follows belongs to one bench
  } catch (problem) {
    if (problem.unauthorised) return;
    bar.showFailure(problem.after("Trying again"));
    setTimeout(begin, ASK_AGAIN_MS);
    return;
  }
  form.load();
  runs.load();
  events.load();
  health.open();
  link.open();
  requestStatus();
  router.go();
}

setInterval(showAge, 250);
setInterval(() => {
  const due = performance.now() - requestedAt > (bar.stale ? REQUEST_EVERY.stale : REQUEST_EVERY.fresh);
  if (due && !withoutRig && bar.age > REQUEST_AFTER && !isAsking()) requestStatus();
}, 200);
document.addEventListener("unauthorised", () => askToSignIn("The session has expired or was ended. Sign in again; this view stays open."));
addEventListener("hashchange", () => /^#(token|code)=/.test(location.hash) && arrive());

arrive();

// Operates the web page like a technician, on the fake service of the tests, and prints the observations as JSON:
//   node look_at_page.mjs URL TOKEN CHROMIUM
// Every wait has playwright's time limit, and its error names the condition.

import { makeWaits, openPage } from "./browser.mjs";

const [url, token, chromium] = process.argv.slice(2);
const { page, close } = await openPage(chromium);
const seen = { errors: [] };
page.on("pageerror", (error) => seen.errors.push(String(error)));
await page.addInitScript(() => {
  window.shifts = [];
  new PerformanceObserver((list) => {
    for (const entry of list.getEntries()) {
      const of = entry.sources.map(({ node }) => node?.id || node?.className);
      if (!entry.hadRecentInput) window.shifts.push({ value: entry.value, of });
    }
  }).observe({ type: "layout-shift", buffered: true });
});

const text = (selector) => page.locator(selector).innerText();
const { until, hasText } = makeWaits(page);
const openView = async (name) => {
  await page.click(`.views a[data-view=${name}]`);
  await page.locator(`#view-${name}`).waitFor();
};
const canvases = () => page.evaluate(() => [...document.querySelectorAll("canvas.trace")].map((canvas) => canvas.toDataURL()));
const posted = (path) => page.waitForRequest((request) => request.method() === "POST" && request.url().endsWith(path));

async function letIn() {
  await page.goto(`${url}/#token=wrong`);
  await hasText("#sign-in-reason", "credentials are wrong");
  await page.check("input[value=token]");
  await page.fill("#token", token);
  await page.keyboard.press("Enter");
  await hasText("#state-word", "Idle");
  await hasText("#methods", "quick");
  seen.address = page.url();
}

async function watch() {
  await hasText("#readings", "−10.00 … 10.00"); // a complete stroke has arrived, in millimetres
  const before = await canvases();
  await until(
    (old) => [...document.querySelectorAll("canvas.trace")].every((canvas, k) => canvas.toDataURL() !== old[k]), before);
  seen.canvases = before.length;
  seen.readings = await page.locator("#readings > div").allInnerTexts();
  seen.instruments = await page.locator("#instruments tr").allInnerTexts();
  seen.shifts = await page.evaluate(() => window.shifts);
  await openView("runs");
  seen.runs = await page.locator("#runs tr").allInnerTexts();
  await openView("bench");
}

async function start() {
  await page.check("input[value=quick]");
  await page.fill("#specimen", "MR-0042");
  await page.fill("#operator", "A. Meyer");
  await page.click("#start");
  await hasText("#start-note", "Not started");
  seen.refusal = await text("#start-note");
  await page.click("#start");
  await hasText("#state-word", "Running");
  seen.focused = await page.evaluate(() => document.activeElement.id);
  seen.progress = [await text("#segment"), await text("#time-left"), await page.locator("#progress").evaluate((bar) => bar.value)];
  seen.prepareWhileRunning = await page.locator("#prepare button").evaluateAll((all) => all.every((one) => one.disabled));
  seen.startWhileRunning = await page.locator("#start").isDisabled();
}

async function stop() {
  await page.focus("#specimen");
  await page.keyboard.press("Space");
  seen.specimen = await page.inputValue("#specimen");
  seen.stateAfterSpaceInField = await text("#state-word");
  const request = posted("/stop");
  await page.keyboard.press("Escape");
  seen.stopped = new URL((await request).url()).pathname;
  await hasText("#state-word", "Tripped");
  seen.trip = await text("#bar-line");
}

async function reset() {
  await page.click("#reset");
  await page.click("#reset-dialog button[value=cancel]");
  seen.stateAfterKeeping = await text("#state-word");
  await page.click("#reset");
  const request = posted("/bench/reset");
  await page.click("#reset-dialog button[value=reset]");
  await request;
  await hasText("#state-word", "Idle");
}

async function prepare() {
  await page.click("#preparation summary");
  await page.fill("#move-to", "");
  await page.click("#prepare button[data-step=move]");
  await hasText("#prepare-note", "enter a target");
  await page.fill("#move-to", "12.5");
  await page.click("#prepare button[data-step=move]");
  await hasText("#prepare-note", "move is done");
  await page.click("#prepare button[data-step=mount]");
  await hasText("#reference-state", "a specimen is clamped");
  seen.nextStep = await text("#prepare [aria-current=step] h3");
  await page.click("#prepare button[data-step=home]");
  await page.click("#home-dialog button[value=cancel]");
  await page.click("#prepare button[data-step=home]");
  await page.click("#home-dialog button[value=home]");
  await hasText("#prepare-note", "clamped");
  seen.homing = await text("#prepare-note");
}

async function cancelJob() {
  await openView("runs");
  const row = page.locator("#runs tr").nth(2);
  await row.getByRole("button", { name: /Cancel/ }).click();
  await hasText("#runs", "The job was cancelled");
  seen.cancelled = await row.innerText();
  await openView("bench");
}

async function loseConnection() {
  await page.evaluate((known) => {
    fetch("/api/v1/silence", { method: "POST", headers: { Authorization: `Bearer ${known}` } });
  }, token);
  await hasText("#state-word", "No connection");
  await hasText("#bar-line", "did not answer within");
  await page.click("#stop");
  await hasText("#bar-detail", "not confirmed");
  seen.lost = [await text("#bar-line"), await text("#bar-detail")];
  seen.greyed = await page.locator("#live").evaluate((live) => live.classList.contains("stale"));
}

async function measureWidths() {
  seen.overflow = {};
  seen.stopPlaces = {};
  for (const width of [1280, 768, 390]) {
    await page.setViewportSize({ width, height: 800 });
    await until((wanted) => innerWidth === wanted, width);
    seen.overflow[width] = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    seen.stopPlaces[width] = await page.evaluate(() => {
      const { left, right } = document.getElementById("stop").getBoundingClientRect();
      return { left, right };
    });
  }
}

/** Returns a known signal with one spike and one hole, and its envelope. */
async function thin() {
  return page.evaluate(async () => {
    const { SampleRing, envelope } = await import("./live/ring.js");
    const ring = new SampleRing(["force"], 8192);
    const given = Array.from({ length: 20_000 }, (_, k) => (k === 15_123 ? 50 : Math.sin(k / 300)));
    for (let k = 17_000; k < 18_000; k++) given[k] = NaN;
    for (let k = 0; k < given.length; k += 50) {
      ring.push({ utc: 100 + k / 1000, period: 1e-3, count: 50, columns: { force: Float32Array.from(given.slice(k, k + 50)) } });
    }
    const [times, values] = envelope(ring, { field: "force", scale: 2, hole: 0.25 }, 6, 300, [[], []]);
    const recent = ring.recent("force", 6);
    ring.push({ utc: 119.95, period: 1e-3, count: 50, columns: { force: new Float32Array(50) } });
    const afterRepetition = ring.written;
    ring.revealUntil(115);
    const shown = [ring.end, ring.recent("force", 6).high];
    ring.push({ utc: 5, period: 1e-3, count: 1, columns: { force: new Float32Array(1) } });
    return { given, times, values, recent, shown, afterRepetition, afterRestart: ring.count };
  });
}

try {
  for (const step of [letIn, watch, start, stop, reset, prepare, cancelJob, loseConnection, measureWidths]) await step();
  seen.thinned = await thin();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

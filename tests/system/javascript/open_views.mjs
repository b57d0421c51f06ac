// Opens each view of the page by its address, like a person with bookmarks, and prints the observations as JSON:
//   node open_views.mjs URL TOKEN CHROMIUM

import { makeWaits, openPage } from "./browser.mjs";
import { makeChecks } from "./page_checks.mjs";

const [url, token, chromium] = process.argv.slice(2);
const VIEWS = ["#/bench", "#/plan/quick", "#/runs", "#/runs/run-1", "#/runs/run-1/report"];
const seen = { errors: [], titles: {}, violations: {}, small: {}, overflow: {} };
const { page, close } = await openPage(chromium, { width: 1400, height: 900 });
page.on("pageerror", (error) => seen.errors.push(String(error)));
const { audit, auditColours, findSmall, findOverflow } = makeChecks(page);

const { until, hasText } = makeWaits(page);
const shownTitle = () => page.evaluate(() => [...document.querySelectorAll("h1")].find((one) => one.checkVisibility()).innerText);
const READY = {
  "#/bench": ["#readings", "−10.00 … 10.00"], "#/plan/quick": ["#plan", "k0 to 3 %"], "#/runs": ["#runs", "MR-0042"],
  "#/runs/run-1": ["#run", "Residual by condition"], "#/runs/run-1/report": ["#run", "Report: measured over simulated"],
};

async function openDirectly(hash) {
  await page.goto("about:blank");
  await page.goto(`${url}/${hash}`); // a new document each time, as from a bookmark
  await hasText(...READY[hash]);
  await hasText("#state-word", "Idle");
  seen.titles[hash] = await shownTitle();
  for (const width of [1400, 820]) {
    await page.setViewportSize({ width, height: 1180 });
    seen.violations[`${hash} ${width}`] = await audit();
    seen.small[`${hash} ${width}`] = await findSmall();
    seen.overflow[`${hash} ${width}`] = await findOverflow();
  }
  await page.emulateMedia({ colorScheme: "dark" });
  seen.violations[`${hash} dark`] = await auditColours();
  await page.emulateMedia({ colorScheme: "light" });
}

async function signIn() {
  await page.goto(`${url}/#/runs/run-1/report`);
  await page.locator("#sign-in-dialog").waitFor();
  await page.check("input[value=token]");
  seen.violations.signIn = await audit();
  seen.small.signIn = await findSmall();
  await page.fill("#token", token);
  await page.keyboard.press("Enter");
  await hasText(...READY["#/runs/run-1/report"]);
  seen.addressAfterSignIn = new URL(page.url()).hash;
}

async function readReport() {
  const report = page.frameLocator("iframe.report");
  await report.locator("h1").waitFor();
  await page.reload();
  await report.locator("h1").waitFor();
  seen.report = await report.locator("body").innerText();
}

/** Imports a recording by the file button, which is refused, and then two by dropping them onto the view. */
async function importFiles() {
  await page.goto(`${url}/#/plan/quick`);
  await page.locator("#import").focus();
  await page.keyboard.press("Enter");
  await page.setInputFiles("#upload-files", { name: "bad.csv", mimeType: "text/csv", buffer: Buffer.from("force_n\nmuch\n") });
  await page.locator("#upload-units").waitFor();
  await page.locator("#upload-units summary").click();
  seen.violations.upload = await audit();
  seen.small.upload = await findSmall();
  await page.locator("#upload-specimen").focus();
  await page.keyboard.press("Enter");
  await hasText("#upload-note", "Not imported");
  seen.refusedImport = await page.locator("#upload-note").innerText();
  await page.keyboard.press("Escape");
  seen.uploadLeft = await page.locator("#upload-dialog").evaluate((dialog) => !dialog.open);
  await drop(["one.csv", "two.csv"]);
  seen.dropped = await page.locator("#upload-list").innerText();
  await page.fill("#upload-specimen", "MR-0099");
  await page.selectOption("#upload-displacement", { label: "mm" });
  await page.selectOption("#upload-force", { label: "kN" });
  await page.getByLabel("Force is positive in compression").check();
  await page.click("#upload-start");
  await hasText("#run", "import of a recording made elsewhere");
  seen.imported = [await shownTitle(), new URL(page.url()).hash];
}

/** Drops files onto the middle of the view. */
const drop = (names) => page.evaluate((all) => {
  const dataTransfer = new DataTransfer();
  for (const name of all) dataTransfer.items.add(new File(["time_s"], name));
  const view = document.getElementById("main");
  for (const type of ["dragover", "drop"]) view.dispatchEvent(new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true }));
}, names);

async function readRun() {
  await page.goto(`${url}/#/runs/run-1`);
  await hasText("#run", "Residual by condition");
  seen.facts = await page.locator("#run .facts").first().innerText();
  seen.tables = await page.locator("#run caption").allInnerTexts();
  seen.drives = await page.locator("#run table", { hasText: "Force error by drive" }).locator("tbody th").allInnerTexts();
  await page.getByRole("button", { name: /^Identify/ }).click();
  await hasText("#run", "nothing was computed again");
}

async function plan() {
  await page.goto(`${url}/#/plan/identification`);
  await hasText("#plan", "Preview");
  await hasText("#plan", "k0 to 3 %");
  seen.forecast = await page.locator("#plan .forecast").innerText();
  seen.planFacts = await page.locator("#plan .facts").innerText();
  await page.getByRole("link", { name: "Use on the bench" }).click();
  await until(() => document.querySelector("input[value=identification]")?.checked);
  seen.focused = await page.evaluate(() => document.activeElement.innerText);
}

async function changeUnits() {
  await page.selectOption("#unit-force", "lbf");
  await page.selectOption("#unit-length", "in");
  await hasText("#readings", "−0.394 … 0.394");
  await page.reload();
  await hasText("#readings", "−0.394 … 0.394");
  seen.units = await page.locator("#readings .unit").allInnerTexts();
  seen.captions = await page.locator("figure.loop figcaption").allInnerTexts();
}

/** Walks with the keyboard from the first link to a run, and back. */
async function walk() {
  await page.goto(`${url}/#/bench`);
  await page.locator(".views a[data-view=runs]").focus();
  await page.keyboard.press("Enter");
  await until(() => document.activeElement.innerText === "Runs");
  for (let k = 0; k < 10 && !(await page.evaluate(() => document.activeElement.matches("#runs a"))); k++) await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  await hasText("#run", "Facts");
  seen.walked = new URL(page.url()).hash;
  await page.goBack();
  await page.locator("#runs").waitFor();
}

/** Counts the tones of a trip, and after it is silenced. */
async function trip() {
  await page.goto(`${url}/#/plan/quick`);
  await hasText("#plan", "Preview");
  await page.evaluate(() => {
    window.tones = 0;
    const begin = OscillatorNode.prototype.start;
    OscillatorNode.prototype.start = function start(...times) {
      window.tones += 1;
      return begin.apply(this, times);
    };
  });
  await page.click("#plan-title"); // sound is allowed after a click
  await fetch(`${url}/api/v1/bench/stop`, { method: "POST", headers: { Authorization: `Bearer ${token}` } });
  await page.locator("#trip").waitFor();
  await until(() => window.tones >= 4);
  seen.trip = await page.locator("#trip").innerText();
  seen.violations.trip = await audit();
  await page.click("#silence");
  seen.silenced = await page.locator("#silence").isHidden();
  seen.bannerStays = await page.locator("#trip").isVisible();
}

/** Reads the events in a tab that has just been opened, and their number on the service. */
async function readEvents() {
  const stored = () => fetch(`${url}/api/v1/events`, { headers: { Authorization: `Bearer ${token}` } }).then((answer) => answer.json());
  const tab = await page.context().newPage();
  await tab.goto(`${url}/#/bench`);
  await makeWaits(tab).hasText("#state-word", "Tripped");
  await makeWaits(tab).until((count) => document.querySelectorAll("#events time").length >= count, (await stored()).items.length);
  seen.events = await tab.locator("#events li").allInnerTexts();
  seen.storedEvents = (await stored()).items.length;
}

try {
  for (const step of [signIn, readReport]) await step();
  for (const hash of VIEWS) await openDirectly(hash);
  for (const step of [readRun, plan, changeUnits, walk, importFiles, trip]) await step();
  await readEvents();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

// Edits a copy of a method in the form and as JSON, and stores it; prints the observations as JSON:
//   node edit_method.mjs URL TOKEN CHROMIUM

import { makeWaits, openPage } from "./browser.mjs";
import { makeChecks } from "./page_checks.mjs";

const [url, token, chromium] = process.argv.slice(2);
const seen = { errors: [], findings: {}, problems: {} };
const { page, close } = await openPage(chromium, { width: 1400, height: 900 });
page.on("pageerror", (error) => seen.errors.push(error.stack));

const { until, hasText } = makeWaits(page);
const { inspect } = makeChecks(page);
const hash = () => new URL(page.url()).hash;
/** Field of a label inside the part of the form with a title. */
const field = (label, part = "1: ") => page.locator(`.form details:has(> summary:text-matches("^${part}"))`).getByLabel(label, { exact: false }).first();
const top = (label) => page.locator(".editor .form > .fields").getByLabel(label);
const marked = () => page.evaluate(() => {
  const found = document.querySelector(".form [aria-invalid]");
  return found && [found.closest("label").querySelector("span").innerText, found.closest(".field").querySelector(".problem").innerText];
});

async function openCopy() {
  await page.goto(`${url}/#token=${token}`);
  await hasText("#state-word", "Idle");
  await page.goto(`${url}/#/plan/quick`);
  await hasText("#plan", "Edit a copy");
  await page.getByRole("link", { name: "Edit a copy" }).click();
  await hasText(".editor", "Heat in the damper");
  seen.address = hash();
  seen.labels = await page.locator(".form details").first().locator("label > span").allInnerTexts();
  seen.amplitude = await field("Amplitude [mm]").inputValue();
  await top("Name").fill("quick_wide");
  await field("Amplitude [mm]").fill("15");
  await hasText(".editor .forecast", "15 mm");
  seen.findings.form = await inspect();
}

async function makeMistakes() {
  await field("Amplitude [mm]").fill("40");
  await hasText(".editor > .problem", "exceeds the limit");
  seen.problems.limit = await marked();
  await page.getByRole("button", { name: "Store as a version" }).click();
  await until(() => document.activeElement.matches("[aria-invalid]"));
  seen.findings.problem = await inspect();
  await field("Amplitude [mm]").fill("15");
  await until(() => !document.querySelector(".form [aria-invalid]"));
  await field("Kind").selectOption("triangle");
  await hasText(".editor > .problem", "missing");
  seen.problems.missing = await marked();
  seen.kept = await field("Amplitude [mm]").inputValue();
  await field("Corner acceleration [m/s²]").fill("4");
  await until(() => !document.querySelector(".form [aria-invalid]"));
  await field("Levels, separated by commas [V]").fill("0.1; 0.2 x");
  await hasText(".editor > .problem", "Not valid yet");
  seen.problems.list = await marked();
  await field("Levels, separated by commas [V]").fill("0, 0.2, 0.4");
  await until(() => !document.querySelector(".form [aria-invalid]"));
  await top("Drive kind").selectOption("coil_a");
  seen.inAmperes = await field("Levels, separated by commas [A]").inputValue();
  await top("Drive kind").selectOption("coil_v");
}

async function changeSegments() {
  await page.getByRole("button", { name: "Duplicate 1: 10mm_1Hz" }).click();
  seen.duplicated = await page.locator(".form details > summary").allInnerTexts();
  await page.getByRole("button", { name: "Move up 2: 10mm_1Hz_copy" }).click();
  seen.moved = await page.locator(".form details > summary").allInnerTexts();
  await page.getByRole("button", { name: "Remove 1: 10mm_1Hz_copy" }).click();
  seen.removed = await page.locator(".form details > summary").allInnerTexts();
  await page.getByLabel("Before every later segment").check();
  await page.getByLabel("Rest [s]").last().fill("1.5");
}

async function editJson() {
  await page.getByRole("button", { name: "Edit as JSON" }).click();
  const text = await page.locator(".editor > textarea").inputValue();
  await page.locator(".editor > textarea").fill(text.replace('"rate_hz": 1000', '"rate_hz": 2000,'));
  await hasText(".editor > .problem", "Not JSON");
  await page.getByRole("button", { name: "Edit as a form" }).click();
  seen.problems.json = await page.locator(".editor > .problem").innerText();
  seen.findings.json = await inspect();
  await page.locator(".editor > textarea").fill(text.replace('"rate_hz": 1000', '"rate_hz": 2000'));
  await until(() => document.querySelector(".editor > .problem").innerText === "");
  await page.getByRole("button", { name: "Edit as a form" }).click();
  seen.rate = await top("Rate [Hz]").inputValue();
  await page.reload();
  await hasText(".editor > .note", "unfinished draft");
  seen.draft = await top("Rate [Hz]").inputValue();
}

async function store() {
  await page.getByRole("button", { name: "Assess what the strokes identify" }).click();
  await hasText(".editor .words", "k0 to 3 %");
  await page.getByRole("button", { name: "Store as a version" }).click();
  await hasText("#plan-note", "Stored as version");
  seen.stored = [await page.locator("#plan-note").innerText(), hash()];
}

async function beginNew() {
  await page.selectOption("#unit-length", "in");
  await page.locator("#view-plan .choices > a").click();
  await hasText(".editor", "Heat in the damper");
  seen.fresh = [hash(), await page.locator("#plan-title").innerText(), await field("Amplitude [in]").inputValue()];
  await field("Amplitude [in]").fill("0.25");
  await hasText(".editor .forecast", "0.25 in");
  await page.getByRole("button", { name: "Discard the draft" }).click();
  seen.discarded = await field("Amplitude [in]").inputValue();
}

try {
  for (const step of [openCopy, makeMistakes, changeSegments, editJson, store, beginNew]) await step();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

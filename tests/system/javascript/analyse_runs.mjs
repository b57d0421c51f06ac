// Analyses selected runs and reads what has changed since another version; prints the observations as JSON:
//   node analyse_runs.mjs URL TOKEN CHROMIUM

import { readFile } from "node:fs/promises";

import { makeWaits, openPage } from "./browser.mjs";
import { makeChecks } from "./page_checks.mjs";

const [url, token, chromium] = process.argv.slice(2);
const seen = { errors: [], findings: {} };
const { page, close } = await openPage(chromium, { width: 1400, height: 1000 });
page.on("pageerror", (error) => seen.errors.push(String(error)));

const { hasText } = makeWaits(page);
const { inspect } = makeChecks(page);
const hash = () => new URL(page.url()).hash;
const rows = () => page.locator("#batch tbody tr").allInnerTexts();
const isFocused = (words) => page.evaluate((text) => document.activeElement.innerText === text, words);

/** Selects runs and requests their diagnosis with the keyboard. */
async function request() {
  await page.goto(`${url}/#token=${token}`);
  await hasText("#state-word", "Idle");
  await page.goto(`${url}/#/runs`);
  await hasText("#runs", "MR-0042");
  seen.without = await page.locator("#analyse-selected").isDisabled();
  for (const run of ["run-1", "run-3"]) await page.locator(`#runs input[data-run=${run}]`).press("Space");
  seen.offered = await page.locator("#batch-kind option").allInnerTexts();
  await page.locator("#analyse-selected").press("Enter");
  await hasText("#batch-note", "1 of 2 not ended yet");
  seen.address = hash();
  seen.title = await isFocused("Batch");
  seen.running = await rows();
}

/** Reads the table as it changes, in another unit, as a file, and after a reload. */
async function read() {
  await page.locator("#batch tbody a").first().focus();
  await hasText("#batch-note", "all have ended");
  seen.focusStays = await page.evaluate(() => document.activeElement.closest("#batch tbody") !== null);
  seen.note = await page.locator("#batch-note").innerText();
  seen.heads = await page.locator("#batch thead th").allInnerTexts();
  seen.ended = await rows();
  const [file] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save as CSV" }).click()]);
  seen.file = [file.suggestedFilename(), (await readFile(await file.path(), "utf8")).split("\n")[0]];
  await page.selectOption("#unit-force", "lbf");
  await hasText("#batch", "Law alone [lbf]");
  seen.inLbf = (await rows())[0];
  await page.selectOption("#unit-force", "N");
  await page.reload();
  await hasText("#batch-note", "all have ended");
  seen.findings.batch = await inspect();
  await page.locator("#batch tbody a").first().click();
  await hasText("#run", "Provenance");
  seen.opened = hash();
}

/** Requests an identification of one run. */
async function identify() {
  await page.goto(`${url}/#/runs?compare=run-1`);
  await hasText("#selection-note", "1 run is selected");
  await page.selectOption("#batch-kind", "identify");
  await page.click("#analyse-selected");
  await hasText("#batch-note", "Identification of 1 run");
  seen.fit = await rows();
}

async function fail() {
  seen.problems = {};
  for (const [address, words] of [["#/batches", "names no batch"], ["#/batches/none", "cannot be shown"]]) {
    await page.goto(`${url}/${address}`);
    await hasText("#batch-note", words);
    seen.problems[address] = await page.locator("#batch-note").innerText();
  }
}

/** Reads what has changed since the result of another version. */
async function readChanges() {
  await page.goto(`${url}/#/runs/run-1`);
  const section = page.getByRole("region", { name: "Provenance" });
  await section.locator("summary").click();
  await section.getByText("changes since").first().waitFor();
  seen.changes = (await section.innerText()).split("\n").map((line) => line.trim()).filter(Boolean);
  seen.table = await section.locator("tbody tr").allInnerTexts();
  seen.findings.changes = await inspect([820]);
}

try {
  for (const step of [request, read, identify, fail, readChanges]) await step();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

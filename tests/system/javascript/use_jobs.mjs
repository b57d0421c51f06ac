// Follows the queue of jobs and cancels one like a person with a keyboard, and prints the observations as JSON:
//   node use_jobs.mjs URL TOKEN CHROMIUM

import { makeWaits, openPage } from "./browser.mjs";
import { makeChecks } from "./page_checks.mjs";

const [url, token, chromium] = process.argv.slice(2);
const seen = { errors: [] };
const { page, close } = await openPage(chromium, { width: 1400, height: 900 });
page.on("pageerror", (error) => seen.errors.push(String(error)));
const { until, hasText } = makeWaits(page);
const { inspect } = makeChecks(page);

const hasRows = (count) => until((wanted) => document.querySelectorAll("#jobs tr").length === wanted, count);
const focused = () => page.evaluate(() => document.activeElement.innerText);

async function open() {
  await page.goto(`${url}/#token=${token}`);
  await hasText("#state-word", "Idle");
  await page.getByRole("link", { name: /Queue/ }).press("Enter");
  await hasRows(3);
  seen.address = await page.evaluate(() => location.hash);
  seen.focusedTitle = await focused();
  await page.reload(); // as from a bookmark
  await hasRows(3);
  await hasText("#state-word", "Idle");
  await until(() => !document.getElementById("jobs").innerText.includes("–\tCancel"));
  seen.rows = await page.locator("#jobs tr").allInnerTexts();
  seen.buttons = await page.locator("#jobs button").evaluateAll((all) => all.map((one) => one.getAttribute("aria-label")));
  seen.findings = await inspect();
}

/** Cancels a queued job, and then the running one. */
async function cancel() {
  await page.getByRole("button", { name: "Cancel diagnose of run run-1" }).press("Enter");
  await hasRows(2);
  await hasText("#jobs-answer", "was requested");
  seen.answer = await page.locator("#jobs-answer").innerText();
  seen.focusedAfterwards = await focused();
  await page.getByRole("button", { name: "Cancel identify of run run-2" }).press("Enter");
  await hasRows(1);
  await page.getByRole("link", { name: "run-1" }).press("Enter");
  await hasText("#run", "predict queued: number 2 in the queue");
  seen.inRun = await page.locator("#run .actions button[aria-label^=Cancel]").evaluateAll((all) => all.map((one) => one.getAttribute("aria-label")));
  await page.getByRole("button", { name: /^Cancel predict/ }).press("Enter");
  await hasText("#run", "The job was cancelled.");
  await page.goBack();
  await hasText("#jobs-note", "No job is running or queued.");
}

try {
  for (const step of [open, cancel]) await step();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

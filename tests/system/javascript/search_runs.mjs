// Searches for runs by tag and in the trash like a person with a keyboard, and prints the observations as JSON:
//   node search_runs.mjs URL TOKEN CHROMIUM

import { makeWaits, openPage } from "./browser.mjs";
import { makeChecks } from "./page_checks.mjs";

const [url, token, chromium] = process.argv.slice(2);
const seen = { errors: [] };
const { page, close } = await openPage(chromium, { width: 1400, height: 900 });
page.on("pageerror", (error) => seen.errors.push(String(error)));
const { until, hasText } = makeWaits(page);
const { inspect } = makeChecks(page);

const hasRows = (count) => until((wanted) => document.querySelectorAll("#runs tr").length === wanted, count);
const rows = () => page.locator("#runs tr").allInnerTexts();
const address = () => page.evaluate(() => location.hash);

async function findByTag() {
  await page.goto(`${url}/#token=${token}`);
  await hasText("#state-word", "Idle");
  await page.goto(`${url}/#/runs`);
  await hasRows(3);
  seen.textLabel = await page.locator("#search-form label").first().innerText();
  await page.locator("#search-more summary").click();
  await page.locator("#search-form [name=tag]").fill("seal");
  await page.keyboard.press("Enter");
  await hasRows(1);
  seen.tagged = [await address(), ...(await rows())];
  await page.reload();
  await hasRows(1);
  seen.keptTag = await page.locator("#search-form [name=tag]").inputValue();
}

/** Looks into the trash, keeps the address, restores the run in its own view and returns. */
async function findInTrash() {
  await page.getByRole("button", { name: "All runs" }).click();
  await hasRows(3);
  await page.getByRole("checkbox", { name: "In the trash" }).press("Space");
  await page.getByRole("button", { name: "Search" }).click();
  await hasRows(1);
  seen.findings = await inspect();
  seen.trashed = [await address(), ...(await rows())];
  await page.reload();
  await hasRows(1);
  seen.keptTick = await page.getByRole("checkbox", { name: "In the trash" }).isChecked();
  await page.locator("#runs th a").press("Enter");
  await hasText("#run", "In the trash since");
  await page.getByRole("button", { name: /^Restore/ }).click();
  await hasText("#run", "The run was restored.");
  await page.goBack();
  seen.restored = await rows();
  await page.reload();
  await hasText("#runs-note", "The trash is empty.");
  seen.empty = await page.locator("#runs tr").count();
}

try {
  for (const step of [findByTag, findInTrash]) await step();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

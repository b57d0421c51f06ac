// Follows a specimen over its runs like a person with a keyboard, and prints the observations as JSON:
//   node follow_specimen.mjs URL TOKEN CHROMIUM

import { makeWaits, openPage } from "./browser.mjs";
import { makeChecks } from "./page_checks.mjs";

const [url, token, chromium] = process.argv.slice(2);
const SERIAL = "MR-0100";
const seen = { errors: [], findings: {} };
const { page, close } = await openPage(chromium, { width: 1400, height: 900 });
page.on("pageerror", (error) => seen.errors.push(error.stack));

const { until, hasText } = makeWaits(page);
const { inspect } = makeChecks(page);
const hash = () => new URL(page.url()).hash;
const ask = (method, path, body, headers = {}) => fetch(`${url}/api/v1/${path}`, {
  method, body: body && JSON.stringify(body), headers: { Authorization: `Bearer ${token}`, "Content-Type": "application/json", ...headers },
});
const open = async (address, selector, words) => {
  await page.goto(`${url}/${address}`);
  await hasText(selector, words);
};

/** Walks with the keyboard from the navigation to the list and to a specimen. */
async function walk() {
  await page.goto(`${url}/#token=${token}`);
  await hasText("#state-word", "Idle");
  await page.locator(".views a[data-view=specimens]").focus();
  await page.keyboard.press("Enter");
  await hasText("#specimens", SERIAL);
  seen.list = await page.locator("#specimens tr").allInnerTexts();
  seen.findings.list = await inspect();
  await page.locator("#specimens a", { hasText: SERIAL }).focus();
  await page.keyboard.press("Enter");
  await hasText("#specimen-parts", "k0");
  seen.walked = hash();
  seen.here = await page.locator(".views a[aria-current]").innerText();
}

async function search() {
  await page.goto(`${url}/#/specimens`);
  await page.fill("#specimens-form input", "endurance");
  await page.keyboard.press("Enter");
  await until(() => document.querySelectorAll("#specimens tr").length === 1);
  seen.found = [await page.locator("#specimens th").innerText(), hash()];
}

/** Looks at the parameters of the fits, and asks for a trend that does not exist yet. */
async function computeTrend() {
  await open(`#/specimens/${SERIAL}`, ".request", "There is no trend");
  seen.fitQuantities = await page.locator("select[name=quantity] option").allInnerTexts();
  await page.getByRole("button", { name: "Compute the trend" }).click();
  await hasText(".request", "run 4 of 8");
  seen.progress = await page.locator(".request progress").evaluate(({ value }) => value);
  seen.mayCancel = await page.getByRole("button", { name: "Cancel the computation" }).isVisible();
  seen.findings.running = await inspect();
  await ask("POST", `specimens/${SERIAL}/finish-trend`);
  await hasText("#specimen-parts", "Cause");
  seen.request = await page.locator(".request").innerText();
  seen.cause = await page.locator(".cause").innerText();
  seen.drift = await page.locator(".drift").innerText();
  seen.chosen = await page.locator("select[name=quantity]").inputValue();
}

async function readTrend() {
  await page.locator("summary", { hasText: "All 4 quantities" }).click();
  seen.changes = await page.locator(".words tbody tr").allInnerTexts();
  await page.selectOption("select[name=quantity]", "k0");
  await hasText("[role=status]:has(> .drift)", "Outlier");
  seen.outlier = await page.locator("[role=status]:has(> .drift)").innerText();
  await page.selectOption("select[name=over]", "time");
  await hasText(".drift", "per day");
  seen.address = hash();
  await page.locator("summary", { hasText: "Values as a table" }).click();
  seen.values = await page.locator("[aria-label='k0 over the runs'] tbody tr").allInnerTexts();
  seen.figure = await page.locator(".plot.trend").getAttribute("aria-label");
  seen.findings.trend = await inspect();
  await page.reload();
  await hasText(".drift", "per day");
  seen.reloaded = await page.locator("select[name=quantity]").inputValue();
  await page.selectOption("select[name=quantity]", "eta");
  await hasText(".drift", "No drift can be stated");
  await page.selectOption("select[name=quantity]", "gas_spring.preload");
  await hasText(".drift", "N per day");
  seen.perDay = await page.locator(".drift").innerText();
}

/** Edits the facts while somebody else changes them too. */
async function edit() {
  await open(`#/specimens/${SERIAL}`, "#specimen-parts", "Edit facts");
  await page.getByRole("button", { name: "Edit facts" }).focus();
  await page.keyboard.press("Enter");
  seen.formFocus = await page.evaluate(() => document.activeElement.name);
  seen.findings.form = await inspect();
  await ask("PATCH", `specimens/${SERIAL}`, { damper_kind: "RD-8041" }, { "If-Match": '"1"' });
  await page.fill("textarea[name=description]", "Second service in March");
  await page.fill("input[name=stroke_m]", "20");
  await page.getByRole("button", { name: "Save" }).click();
  await hasText(".form .note", "someone else");
  seen.conflict = await page.locator(".form .note").innerText();
  seen.findings.conflict = await inspect();
  seen.rebased = await page.inputValue("input[name=damper_kind]");
  await page.getByRole("button", { name: "Save" }).click();
  await hasText("#specimen-parts", "Saved.");
  seen.afterSave = await page.evaluate(() => document.activeElement.innerText);
  seen.stored = await (await ask("GET", `specimens/${SERIAL}`)).json();
  await page.selectOption("#unit-length", "in");
  await hasText(".facts", "0.7874 in");
  seen.facts = await page.locator("#specimen-parts .facts").innerText();
}

async function followLinks() {
  await open("#/runs", "#runs", SERIAL);
  await page.locator("#runs td a", { hasText: SERIAL }).first().click();
  await hasText("#specimen-parts", "Runs, newest first");
  seen.fromRuns = hash();
  seen.history = await page.locator("[aria-label='Runs, newest first'] tbody tr").allInnerTexts();
  await page.locator("[aria-label='Runs, newest first'] tbody th a").first().click();
  await hasText("#run", "Facts");
  await page.locator("#run .facts a", { hasText: SERIAL }).click();
  await hasText("#specimen-parts", "Runs, newest first");
  seen.fromRun = hash();
  await open("#/specimens/MR-0050", ".request", "needs 3 runs");
  seen.tooFew = await page.locator(".request").innerText();
  seen.noButton = await page.locator(".request button").isHidden();
  await open("#/specimens/none", "#specimen-note", "cannot be shown");
  seen.unknown = await page.locator("#specimen-note").innerText();
}

try {
  for (const step of [walk, search, computeTrend, readTrend, edit, followLinks]) await step();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

// Looks at the checks and starts one like a person with a keyboard, and prints the observations as JSON:
//   node use_checks.mjs URL TOKEN CHROMIUM

import { makeWaits, openPage } from "./browser.mjs";
import { makeChecks } from "./page_checks.mjs";

const [url, token, chromium] = process.argv.slice(2);
const seen = { errors: [], findings: {} };
const { page, close } = await openPage(chromium, { width: 1400, height: 900 });
page.on("pageerror", (error) => seen.errors.push(String(error)));
const { inspect } = makeChecks(page);
const { hasText } = makeWaits(page);
const rows = () => page.locator("#checks > tr").allInnerTexts();
const chart = () => page.locator("#check-chart").innerText();

async function look() {
  await page.goto(`${url}/#token=${token}`);
  await page.locator(".views a[data-view=calibration]").focus();
  await page.keyboard.press("Enter");
  await hasText("#checks", "force");
  seen.list = await rows();
  seen.specimen = await page.locator("#check-start [name=specimen]").inputValue();
  seen.findings.list = await inspect();
}

async function openChart() {
  await page.getByRole("link", { name: "Chart of the force", exact: true }).focus();
  await page.keyboard.press("Enter");
  await hasText("#check-chart", "Chart of the force");
  seen.address = new URL(page.url()).hash;
  seen.focused = await page.evaluate(() => document.activeElement.innerText);
  seen.chart = await chart();
  seen.drawn = await page.locator("#check-chart canvas").count();
  await page.locator("#check-chart summary").click();
  seen.table = await page.locator("#check-chart tbody tr").allInnerTexts();
  seen.findings.chart = await inspect();
  await page.reload();
  await hasText("#check-chart", "Chart of the force");
}

async function openShuntChart() {
  await page.getByRole("link", { name: "Chart of the force with the shunt" }).focus();
  await page.keyboard.press("Enter");
  await hasText("#check-chart", "Chart of the force with the shunt");
  seen.shuntAddress = new URL(page.url()).hash;
  seen.shuntChart = await chart();
  seen.findings.shuntChart = await inspect([1400]);
  await page.getByRole("link", { name: "Chart of the force", exact: true }).focus();
  await page.keyboard.press("Enter");
  await hasText("#check-chart", `Chart of the force, specimen`);
}

async function chooseUnits() {
  await page.selectOption("#unit-force", "lbf");
  await page.selectOption("#unit-length", "in");
  seen.otherUnits = await rows();
  seen.otherChart = await chart();
  await page.selectOption("#unit-force", "N");
  await page.selectOption("#unit-length", "mm");
}

async function beginBaseline() {
  await page.getByRole("button", { name: "Begin a new baseline" }).focus();
  await page.keyboard.press("Enter");
  seen.asked = await page.evaluate(() => document.activeElement.name);
  seen.findings.baseline = await inspect([1400]);
  await page.keyboard.type("load cell was replaced");
  await page.keyboard.press("Enter");
  await hasText("#checks-answer", "A new baseline");
  seen.renewed = (await rows()).find((text) => text.startsWith("force"));
}

async function startCheck() {
  await page.getByRole("button", { name: "Start zero check" }).focus();
  await page.keyboard.press("Enter");
  await hasText("#checks-answer", "has started");
  seen.afterStart = await page.evaluate(() => document.activeElement.id);
  await page.getByRole("button", { name: "Start shunt check" }).focus();
  await page.keyboard.press("Enter");
  await hasText("#checks-answer", "The shunt check has started");
}

try {
  for (const step of [look, openChart, openShuntChart, chooseUnits, beginBaseline, startCheck]) await step();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

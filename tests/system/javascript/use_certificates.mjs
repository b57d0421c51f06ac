// Keeps the calibration certificates like a person with a keyboard, and prints the observations as JSON:
//   node use_certificates.mjs URL TOKEN CHROMIUM

import { makeWaits, openPage } from "./browser.mjs";
import { makeChecks } from "./page_checks.mjs";

const [url, token, chromium] = process.argv.slice(2);
const seen = { errors: [], findings: {} };
const { page, close } = await openPage(chromium, { width: 1400, height: 900 });
page.on("pageerror", (error) => seen.errors.push(String(error)));
const { inspect } = makeChecks(page);
const { until, hasText } = makeWaits(page);
const rows = () => page.locator("#certificates tr").allInnerTexts();
const CERTIFICATE = {
  channel: "coil_current", laboratory: "DAkkS-Labor Nord", number: "I-5", date: "2026-01-10", due: "2099-01-09",
  value: "0,1", coverage_factor: "2", standard: "shunt S-3",
};

async function look() {
  await page.goto(`${url}/#token=${token}`);
  await page.locator(".views a[data-view=calibration]").focus();
  await page.keyboard.press("Enter");
  await hasText("#certificates", "4711-26");
  seen.address = new URL(page.url()).hash;
  seen.focused = await page.evaluate(() => document.activeElement.innerText);
  seen.list = await rows();
  seen.health = await page.locator("#health").innerText();
  seen.findings.list = await inspect();
}

async function add() {
  await page.locator("#certificate-add").focus();
  await page.keyboard.press("Enter");
  seen.firstField = await page.evaluate(() => document.activeElement.name);
  seen.findings.form = await inspect();
  for (const [name, value] of Object.entries(CERTIFICATE)) {
    const field = page.locator(`#certificate-form [name=${name}]`);
    if (name === "channel") await field.selectOption(value);
    else await field.fill(name === "value" ? value.replace(",", ".") : value);
  }
  seen.labels = await page.locator("#certificate-form label > span").allInnerTexts();
  for (const [key, points] of [["unreadable", "0 0\n1 one"], ["falling", "0 0\n2 2\n1 1"]]) {
    await page.fill("#certificate-form [name=points]", points);
    await page.locator("#certificate-form button.primary").click();
    await until(() => document.querySelector("#certificate-form .note").innerText.startsWith("Not stored"));
    seen[key] = await page.locator("#certificate-form .note").innerText();
    await page.fill("#certificate-form [name=points]", "");
    await page.evaluate(() => document.querySelector("#certificate-form .note").replaceChildren());
  }
  await page.fill("#certificate-form [name=points]", "−2 -2,002\n0;0\n2\t2,002");
  await page.locator("#certificate-form button.primary").focus();
  await page.keyboard.press("Enter");
  await hasText("#certificates", "I-5");
  await hasText("#certificates-answer", "stored");
  seen.added = (await rows()).find((text) => text.includes("I-5"));
}

async function correct() {
  await page.getByRole("button", { name: "Correct certificate I-5" }).click();
  seen.prefilled = await page.locator("#certificate-form [name=points]").inputValue();
  seen.percent = await page.locator("#certificate-form [name=value]").inputValue();
  seen.fixed = await page.locator("#certificate-form [name=number]").isDisabled();
  await page.fill("#certificate-form [name=reason]", "typing error");
  await page.fill("#certificate-form [name=due]", "2098-01-09");
  await page.keyboard.press("Enter");
  await hasText("#certificates-answer", "version 2");
  seen.corrected = (await rows()).find((text) => text.includes("I-5"));
}

async function withdraw() {
  await page.getByRole("button", { name: "Withdraw certificate I-5" }).click();
  seen.findings.withdraw = await inspect([1400]);
  await page.keyboard.type("shunt was repaired");
  await page.keyboard.press("Enter");
  await hasText("#certificates-answer", "is withdrawn");
  seen.withdrawn = (await rows()).find((text) => text.includes("I-5"));
}

async function readRuns() {
  await page.goto(`${url}/#/runs/run-3`);
  await hasText("#run", "Facts");
  await hasText("#run .facts", "overdue");
  seen.marked = await page.locator("#run .facts").first().innerText();
  await page.goto(`${url}/#/runs/run-1`);
  await hasText("#run", "95 % interval with calibration");
  seen.parameters = await page.locator("#run table", { hasText: "Parameters of the modified" }).locator("tr").allInnerTexts();
  await page.reload();
  await hasText("#run", "95 % interval with calibration");
}

try {
  for (const step of [look, add, correct, withdraw, readRuns]) await step();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

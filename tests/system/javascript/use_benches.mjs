// Works on two benches of one service, and prints the observations as JSON: node use_benches.mjs URL TOKEN CHROMIUM

import { makeWaits, openPage } from "./browser.mjs";
import { makeChecks } from "./page_checks.mjs";

const [url, token, chromium] = process.argv.slice(2);
const { page, close } = await openPage(chromium, { width: 1280, height: 1000, bypassCSP: true });
const { until, hasText } = makeWaits(page);
const { audit, findSmall } = makeChecks(page);
const seen = { errors: [] };
page.on("pageerror", (error) => seen.errors.push(String(error)));

const words = (selector) => page.locator(selector).evaluate((one) => one.innerText.replace(/\s+/g, " ").trim());
const address = () => page.evaluate(() => location.hash);
const hasState = (bench, word) => until(([name, wanted]) =>
  document.getElementById("bench-name")?.textContent === name && document.getElementById("state-word")?.textContent === wanted, [bench, word]);

async function look() {
  return {
    current: await words("#benches [aria-current] strong"), address: await address(), state: await words("#state"),
    stop: await page.getAttribute("#stop", "aria-label"),
  };
}

async function search(bench) {
  await page.goto(`${url}/#/@left/runs?bench=${bench}`);
  await page.reload();
  await hasState("left", "Running");
  await until((empty) => document.getElementById("runs-note").textContent.includes("No run meets") === empty, bench === "right");
  return (await page.locator("#runs tr").count()) === 1;
}

try {
  await page.goto(`${url}/#token=${token}`);
  await hasState("left", "Idle");
  await hasText("#benches", "door open");
  seen.listed = await page.locator("#benches li").evaluateAll((all) => all.map((one) => one.innerText.replace(/\s+/g, " ").trim()));
  seen.first = await look();
  seen.audit = await audit();
  seen.small = await findSmall();
  await page.click("nav.views [data-view=runs]");
  await until(() => location.hash === "#/@left/runs");
  seen.runs = await address();
  await page.focus("#benches li:nth-child(2) a");
  await page.keyboard.press("Enter");
  await hasState("right", "Tripped");
  seen.second = await look();
  await page.goto("about:blank");
  await page.goto(`${url}/#/@right/bench`);
  await hasState("right", "Tripped");
  seen.bookmark = await words("#benches [aria-current] strong");
  await page.click("#benches li:nth-child(1) a");
  await hasState("left", "Idle");
  await page.fill("#specimen", "damper 7");
  await until(() => document.querySelector("#methods input[value=quick]"));
  await page.check("#methods input[value=quick]");
  await page.click("#start");
  await hasState("left", "Running");
  seen.found = [await search("left"), await search("right")];
  await page.keyboard.press("Escape");
  await hasState("left", "Stopping");
  seen.stopped = await words("#state-word");
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

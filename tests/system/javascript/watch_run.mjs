// Starts a run of `quick` on the page of a real service, follows it to its fit, and prints the observations as JSON:
//   node watch_run.mjs URL TOKEN CHROMIUM PICTURE.png
// Every wait has playwright's time limit; that of the fit is longer.

import { makeWaits, openPage } from "./browser.mjs";

const [url, token, chromium, picture] = process.argv.slice(2);
const FIT_WITHIN = 240_000;
const { page, close } = await openPage(chromium, { height: 1100 });
const seen = { errors: [] };
page.on("pageerror", (error) => seen.errors.push(String(error)));

const { until, hasText } = makeWaits(page);
const canvases = () => page.evaluate(() => [...document.querySelectorAll("canvas.trace")].map((canvas) => canvas.toDataURL()));

async function allMoved() {
  const before = await canvases();
  await until(
    (old) => [...document.querySelectorAll("canvas.trace")].every((canvas, k) => canvas.toDataURL() !== old[k]), before);
  return before.length;
}

try {
  await page.goto(`${url}#token=${token}`);
  await hasText("#state-word", "Idle");
  await page.check("input[value=quick]");
  await page.fill("#specimen", "MR-0042");
  await page.click("#start");
  await hasText("#state-word", "Running");
  await until(() => Number(document.querySelector("#progress").value) > 0.3, null, 60_000);
  seen.moved = await allMoved();
  seen.movedAgain = await allMoved();
  seen.readings = await page.locator("#readings > div").allInnerTexts();
  await page.screenshot({ path: picture });
  await hasText("#state-word", "Idle", 60_000);
  await until(() => /N \/ .*N/.test(document.querySelector("#runs tr")?.innerText ?? ""), null, FIT_WITHIN);
  seen.runs = await page.locator("#runs tr").allInnerTexts();
  seen.instruments = await page.locator("#instruments tr").allInnerTexts();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

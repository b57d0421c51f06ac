// Compares recorded runs like a person with keyboard and mouse, and prints the observations as JSON:
//   node compare_runs.mjs URL TOKEN CHROMIUM

import { makeWaits, openPage } from "./browser.mjs";
import { makeChecks } from "./page_checks.mjs";

const [url, token, chromium] = process.argv.slice(2);
const ALL = "#/compare?run=run-1&run=run-2&run=run-3&reference=run-1";
const seen = { errors: [], findings: {}, problems: {} };
const { page, close } = await openPage(chromium, { width: 1400, height: 1000 });
page.on("pageerror", (error) => seen.errors.push(String(error)));

const { until, hasText } = makeWaits(page);
const { inspect } = makeChecks(page);
const hash = () => new URL(page.url()).hash;
const texts = (selector) => page.locator(selector).allInnerTexts();
const box = (run) => page.locator(`#runs input[data-run=${run}]`);
const section = (name) => `#compare section[aria-label="${name}"]`;
const note = () => page.locator("#selection-note").innerText();

/** Selects runs with the keyboard; a search and a new list keep the selection. */
async function select() {
  await page.goto(`${url}/#token=${token}`);
  await hasText("#state-word", "Idle");
  await page.goto(`${url}/#/runs`);
  await hasText("#runs", "MR-0042");
  seen.nothing = [await note(), await page.locator("#compare-selected").isDisabled()];
  seen.truncated = await box("run-0").isDisabled();
  await box("run-1").press("Space");
  seen.one = [await note(), await page.locator("#compare-selected").isDisabled()];
  await page.click("#search-more summary");
  await page.selectOption("[name=outcome]", "lossy");
  await page.locator("#search-form .primary").press("Enter");
  await until(() => document.querySelectorAll("#runs tr").length === 1);
  await box("run-3").press("Space");
  await page.click("#search-clear");
  await until(() => document.querySelectorAll("#runs tr").length > 1);
  seen.kept = await page.locator("#runs input:checked").evaluateAll((all) => all.map((one) => one.dataset.run));
  seen.two = await note();
  await page.locator("#compare-selected").press("Enter");
  await hasText("#compare", "Peak force against velocity");
  seen.address = hash();
}

async function read() {
  await page.goto(`${url}/${ALL}`);
  await hasText(section("Conditions"), "differ");
  seen.order = await texts("#compare h2");
  seen.warnings = await texts("#compare .warnings li");
  seen.all = await page.locator("#compare details li").count();
  seen.captions = await texts("#compare figcaption");
  seen.legend = await texts(`${section("Overlay of one stroke, cycles aligned by phase")} .legend li`);
  seen.styles = await page.locator("#compare .compared .swatch").evaluateAll((all) =>
    all.map((one) => [getComputedStyle(one).color, one.firstChild.getAttribute("stroke-dasharray"), one.lastChild.getAttribute("points")]));
  seen.painted = await countColours();
  seen.drives = await texts(`${section("Tolerance band of the reference")} table >> nth=0 >> tbody tr`);
  seen.strokes = await texts(`${section("Tolerance band of the reference")} table >> nth=1 >> tbody tr`);
  seen.band = await page.locator(`${section("Tolerance band of the reference")} p`).innerText();
  seen.peak = await page.locator(`${section("Peak force against velocity")} tbody tr`).first().innerText();
  seen.energy = await page.locator(`${section("Energy per cycle")} tbody tr`).first().innerText();
  seen.parameters = await texts(`${section("Identified parameters")} tbody tr`);
  seen.missing = await page.locator(`${section("Identified parameters")} p`).first().innerText();
}

/** Counts the pixels of each run's colour in the first plot. */
const countColours = () => page.evaluate(() => {
  const canvas = document.querySelector("#compare .plot canvas");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const count = (text) => {
    const wanted = text.match(/\d+/g).map(Number);
    let found = 0;
    for (let k = 0; k < data.length; k += 4) if (wanted.every((part, c) => Math.abs(part - data[k + c]) < 3)) found += 1;
    return found;
  };
  return [...document.querySelectorAll("#compare .compared .swatch")].map((one) => count(getComputedStyle(one).color));
});

/** Chooses stroke, reference and tolerance; all stand in the address and survive a reload. */
async function choose() {
  await page.locator("#compare .stroke select").selectOption({ label: seen.option = (await texts("#compare .stroke option")).at(-1) });
  await page.locator("#compare .reference input").fill("60");
  await page.locator("#compare .reference input").press("Enter");
  await until(() => !document.querySelector("#compare .mark.bad"));
  seen.focusStays = await page.evaluate(() => document.activeElement.type);
  seen.chosen = hash();
  await page.reload();
  await hasText(section("Conditions"), "differ");
  seen.reloaded = [await page.locator("#compare .reference input").inputValue(), await page.locator("#compare .stroke select").evaluate((one) => one.selectedOptions[0].text)];
  await page.locator("#compare .reference select").selectOption("");
  await hasText(section("Tolerance band of the reference"), "Choose a reference run");
  seen.without = hash();
  await page.getByRole("link", { name: /^Remove B/ }).click();
  await until(() => document.querySelectorAll("#compare .compared li").length === 2);
  seen.removed = hash();
}

async function changeUnits() {
  await page.goto(`${url}/${ALL}`);
  await hasText(section("Conditions"), "differ");
  await page.selectOption("#unit-force", "lbf");
  await page.selectOption("#unit-length", "in");
  await hasText("#compare", "Force [lbf]");
  seen.converted = { warnings: await texts("#compare .warnings li"), captions: await texts("#compare figcaption"), option: (await texts("#compare .stroke option"))[0] };
  await page.selectOption("#unit-force", "N");
  await page.selectOption("#unit-length", "mm");
}

/** Opens addresses that cannot be compared; each is explained, and leads back to the list. */
async function fail() {
  for (const query of ["run=run-1", "run=run-1&run=run-9", "run=run-1&run=run-0"]) {
    await page.goto(`${url}/#/compare?${query}`);
    await until(() => document.querySelector("#compare a.button")?.innerText === "Choose runs");
    seen.problems[query] = await page.locator("#compare-note").innerText();
  }
  await page.getByRole("link", { name: "Choose runs" }).click();
  await hasText("#selection-note", "selected");
  await page.click("#clear-selection");
  seen.cleared = await note();
  await page.goto(`${url}/#/runs/run-2`);
  await page.getByRole("link", { name: "Compare with" }).click();
  await hasText("#selection-note", "1 run is selected");
  seen.from = [hash(), await box("run-2").isChecked()];
}

async function audit() {
  for (const address of [ALL, "#/runs"]) {
    await page.goto("about:blank");
    await page.goto(`${url}/${address}`);
    await hasText("main", "MR-0042");
    seen.findings[address] = await inspect();
  }
}

try {
  for (const step of [select, read, choose, changeUnits, fail, audit]) await step();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

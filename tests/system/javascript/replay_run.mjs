// Replays a recorded run like a person with mouse and keyboard, and prints the observations as JSON:
//   node replay_run.mjs URL TOKEN CHROMIUM

import { makeWaits, openPage } from "./browser.mjs";
import { makeChecks } from "./page_checks.mjs";

const [url, token, chromium] = process.argv.slice(2);
const seen = { errors: [] };
const { page, close } = await openPage(chromium, { width: 1400, height: 1000 });
page.on("pageerror", (error) => seen.errors.push(String(error)));

const { until, hasText } = makeWaits(page);
const { inspect } = makeChecks(page);
const slider = page.locator(".timeline input");
const markText = () => page.locator(".mark-text").innerText();
const time = async () => Number(await slider.inputValue());
const displacement = () => page.locator("#run .readings > div").nth(1).innerText();
/** Waits for a time of the slider and for the extremes of the displacement in the ten seconds before it. */
const shows = (at, extremes) => until(([wanted, words]) =>
  Number(document.querySelector(".timeline input").value) === wanted &&
  document.querySelectorAll("#run .readings > div")[1]?.innerText.includes(words), [at, extremes]);

async function open() {
  await page.goto(`${url}/#token=${token}`);
  await hasText("#state-word", "Idle");
  await page.goto(`${url}/#/runs`);
  await page.getByRole("link", { name: /^Replay of run/ }).last().click();
  await hasText("#run", "not live");
  seen.address = new URL(page.url()).hash;
  await page.reload(); // as from a bookmark
  await hasText("#run", "not live");
  seen.source = await page.locator("#run .note").innerText();
  seen.marks = await page.locator(".timeline button").evaluateAll((marks) => marks.map((mark) => mark.title));
  seen.captions = await page.locator("#run figure.loop figcaption").allInnerTexts();
}

/** Moves by mouse on a segment, an event and the slider, and by keyboard. */
async function seek() {
  await page.getByRole("button", { name: "10mm_1Hz_0.2V" }).click();
  await shows(12, "−10.00 … 10.00");
  seen.text = await slider.getAttribute("aria-valuetext");
  seen.segmentText = await markText();
  await page.getByRole("button", { name: /^checkpoint at 11.0 s/ }).focus();
  seen.focusedText = [await markText(), await time()];
  await page.getByRole("button", { name: /^alarm at 15.0 s/ }).click();
  seen.atEvent = await time();
  seen.pressedText = await markText();
  const { x, y, width, height } = await slider.boundingBox();
  await page.mouse.click(x + width / 4, y + height / 2);
  await hasText("#run .readings", "−5.00 … 5.00");
  seen.clicked = await time();
  await slider.focus();
  await page.keyboard.press("Home");
  await page.keyboard.press("ArrowRight");
  seen.stepped = await time();
  await page.keyboard.press("End");
  await shows(24, "−10.00 … 10.00");
}

async function play() {
  await slider.press("Home");
  await page.selectOption(".replay select", "5");
  await page.getByRole("button", { name: "Play" }).press("Enter");
  await until(() => Number(document.querySelector(".timeline input").value) > 12); // beyond what was loaded at first
  await page.getByRole("button", { name: "Pause" }).click();
  const paused = await time();
  await hasText("#run .readings", "−10.00 … 10.00");
  seen.stayed = (await time()) === paused;
  seen.played = paused;
  seen.reading = await displacement();
}

async function checkFrames() {
  await page.getByRole("button", { name: "Check raw frames" }).click();
  await hasText("#run .note", "decoded again");
  seen.frames = await page.locator("#run .note").innerText();
}

async function audit() {
  seen.findings = await inspect();
  seen.stopIsThere = await page.locator("#stop").isVisible();
}

try {
  for (const step of [open, seek, play, checkFrames, audit]) await step();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

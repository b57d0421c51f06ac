// Uses the campaigns of the page like a person, and prints the observations as JSON:
//   node use_campaigns.mjs URL TOKEN CHROMIUM

import { readFileSync } from "node:fs";

import { makeWaits, openPage } from "./browser.mjs";
import { makeChecks } from "./page_checks.mjs";

const [url, token, chromium] = process.argv.slice(2);
const seen = { errors: [], violations: {}, small: {}, overflow: {}, sent: [] };
const { page, close } = await openPage(chromium, { width: 1400, height: 900 });
page.on("pageerror", (error) => seen.errors.push(String(error)));
page.on("request", (request) => {
  const path = new URL(request.url()).pathname;
  if (path.includes("/campaigns") && request.method() !== "GET") seen.sent.push([request.method(), path.replace("/api/v1/", ""), request.postDataJSON()]);
});

const text = (selector) => page.locator(selector).innerText();
const { hasText } = makeWaits(page);
const { audit, auditColours, findOverflow, findSmall } = makeChecks(page);
const hasState = (word) => page.waitForFunction((wanted) => document.getElementById("state-word").innerText === wanted, word);

async function check(name) {
  for (const width of [1400, 820, 390]) {
    await page.setViewportSize({ width, height: 1000 });
    seen.small[`${name} ${width}`] = await findSmall();
    seen.overflow[`${name} ${width}`] = await findOverflow();
  }
  seen.violations[name] = await audit();
  await page.emulateMedia({ colorScheme: "dark" });
  seen.violations[`${name} dark`] = await auditColours();
  await page.emulateMedia({ colorScheme: "light" });
  await page.setViewportSize({ width: 1400, height: 900 });
}

/** Reaches a campaign from the navigation with the keyboard alone. */
async function walk() {
  await page.goto(`${url}/#token=${token}`);
  await hasState("Idle");
  await page.locator(".views a[data-view=campaigns]").focus();
  await page.keyboard.press("Enter");
  await hasText("#campaigns", "night");
  seen.list = await page.locator("#campaigns tr").allInnerTexts();
  seen.focusedTitle = await page.evaluate(() => document.activeElement.innerText);
  await check("list");
  for (let k = 0; k < 10 && !(await page.evaluate(() => document.activeElement.matches("#campaigns a"))); k++) await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  await hasText("#campaign-question", "tighten the clevis");
  seen.walked = new URL(page.url()).hash;
}

async function readBoard() {
  await hasText("#campaign-trends", "minutes since the start");
  seen.facts = await text("#campaign-facts");
  seen.matrix = await page.locator("#campaign-matrix tbody tr").allInnerTexts();
  seen.heads = await text("#campaign-matrix thead");
  seen.shapes = await page.evaluate(() => {
    const of = (state) => getComputedStyle(document.querySelector(`.step-state[data-state=${state}]`), "::before").content;
    return Object.fromEntries(["pending", "active", "done", "skipped", "failed", "held_back"].map((state) => [state, of(state)]));
  });
  seen.runLink = await page.locator("#campaign-matrix a").first().getAttribute("href");
  seen.messages = await page.locator("#campaign-messages li").allInnerTexts();
  await page.click("#campaign-trends summary >> nth=0");
  seen.trend = await text("#campaign-trends figure >> nth=0");
  await check("board");
}

/** Answers a prompt: without the note that it needs the browser refuses, with it the next run begins. */
async function answerPrompt() {
  await page.fill("#campaign-who", "A. Meyer");
  await page.click("#campaign-answer button");
  seen.refusedBefore = seen.sent.length;
  await page.fill("#campaign-answer textarea", "torque 12 N m");
  await page.waitForTimeout(2_500); // the board is refreshed meanwhile
  seen.typed = await page.inputValue("#campaign-answer textarea");
  await page.keyboard.press("Tab");
  await page.setInputFiles("#campaign-answer [name=photo]", { name: "clevis.png", mimeType: "image/png", buffer: Buffer.from("\x89PNG a photo", "latin1") });
  await page.locator("#campaign-answer button").focus();
  await page.keyboard.press("Enter");
  await hasText("#campaign-facts", "a run is in progress");
  seen.questionIsGone = await page.locator("#campaign-question").isHidden();
  await page.click("#view-campaigns details summary");
  const download = page.waitForEvent("download");
  await page.getByRole("button", { name: /^Save photo of step/ }).click();
  seen.photo = (await download).suggestedFilename();
  await hasText("#campaign-result", "photo.jpg was saved");
}

async function editQueue() {
  const row = (id) => page.locator("#queue tr", { hasText: id });
  await row("s0022").getByRole("button", { name: /^Earlier/ }).focus();
  await page.keyboard.press("Enter");
  await hasText("#campaign-result", "s0022 was moved");
  seen.focusStays = await page.evaluate(() => document.activeElement.getAttribute("aria-label"));
  await row("s0023").getByRole("button", { name: /^Pause before/ }).click();
  await hasText("#queue", "Pause: answer to continue");
  await row("s0024").getByRole("button", { name: /^Delete/ }).click();
  await hasText("#campaign-result", "s0024 was deleted");
  await page.selectOption("#step-place", "now");
  await page.click("#step-form button");
  await hasText("#campaign-result", "Not edited");
  seen.refusedNow = await text("#campaign-result");
  await page.selectOption("#step-kind", "run");
  await page.fill("#step-specimen", "MR-0044");
  await page.fill("#step-method", "quick");
  await page.selectOption("#step-place", "");
  await page.click("#step-form button");
  await hasText("#campaign-result", "was added");
  await page.selectOption("#step-kind", "setup");
  seen.hasPosition = await page.locator("#step-position").isVisible();
  await page.selectOption("#step-setup", "move");
  await page.fill("#step-position", "12.5");
  await page.click("#step-form button");
  await hasText("#queue", "setup step move to 12.5 mm");
  await page.locator("#ended-steps tr", { hasText: "s0013" }).getByRole("button", { name: /^Release/ }).click();
  await hasText("#campaign-result", "s0013 is tried again");
  seen.queue = await page.locator("#queue tr").evaluateAll((rows) => rows.map((one) => one.cells[0].innerText));
  await check("run in progress");
}

async function sendTest() {
  await page.click("#campaign-test");
  await hasText("#campaign-result", "there is no mail server");
  seen.test = await text("#campaign-result");
}

/** Saves the report in both formats, and returns names and contents. */
async function saveReports() {
  seen.reports = [];
  for (const format of ["HTML", "PDF"]) {
    const [saved] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: `Report: ${format}` }).click()]);
    await hasText("#campaign-result", "was saved");
    seen.reports.push([saved.suggestedFilename(), readFileSync(await saved.path(), "utf8"), await text("#campaign-result")]);
  }
}

/** Opens the question before a stop while somebody else starts a run: Escape stops the run, and the next one closes. */
async function stopInDialog() {
  const send = (path, body) => fetch(`${url}/api/v1/${path}`, {
    method: "POST", headers: { Authorization: `Bearer ${token}`, "Content-Type": "application/json" }, body: JSON.stringify(body),
  });
  await send("runs", {}); // the first start is refused
  await page.click("#campaign-stop");
  seen.violations.dialog = await audit();
  await send("runs", { method: "quick", specimen: "MR-0042", operator: "another person" });
  await hasState("Running");
  const stopped = page.waitForRequest((one) => one.method() === "POST" && one.url().endsWith("/stop"), { timeout: 5_000 });
  await page.keyboard.press("Escape");
  seen.stopped = new URL((await stopped).url()).pathname;
  seen.dialogStays = await page.locator("#campaign-dialog").evaluate((dialog) => dialog.open);
  await hasState("Tripped");
  await send("bench/reset");
  await hasState("Idle");
  await page.keyboard.press("Escape");
  seen.dialogLeft = await page.locator("#campaign-dialog").evaluate((dialog) => !dialog.open);
}

async function command(verb, answer, words) {
  await page.click(`#campaign-${verb}`);
  await page.locator("#campaign-dialog-buttons").getByRole("button", { name: answer, exact: true }).click();
  await hasText("#campaign-facts", words);
}

async function control() {
  await command("pause", "Pause", "pausing");
  await command("resume", "Resume", "running");
  seen.focusAfterResume = await page.evaluate(() => document.activeElement.id);
  await command("stop", "Stop now", "stopping");
  seen.canStopAgain = await page.locator("#campaign-stop").isEnabled();
}

/** Starts a campaign from a file: a wrong document is refused, a changed one needs another dry run. */
async function begin() {
  await page.goto(`${url}/#/campaigns`);
  await hasText("#campaigns", "night");
  const give = async (content) => {
    await page.fill("#campaign-document", content);
    await page.click("#campaign-plan-button");
  };
  await give("{");
  await hasText("#campaign-start-note", "is not JSON");
  await give('{"name": "morning", "steps": []}');
  await hasText("#campaign-start-note", "at least one step");
  seen.refusedPlan = await text("#campaign-start-note");
  seen.startsWithoutPlan = await page.locator("#campaign-begin").isEnabled();
  const steps = [{ run: { specimen: "MR-0042", method: "quick" } }, { rest: { seconds: 600 } }];
  await give(JSON.stringify({ name: "strict", steps, methods: "approved" }));
  await hasText("#campaign-plan", "Dry run of strict");
  await page.click("#campaign-begin");
  await hasText("#campaign-start-note", "Not started");
  seen.unapproved = await text("#campaign-start-note");
  const document = { name: "morning", steps };
  await page.setInputFiles("#campaign-file", { name: "morning.json", mimeType: "application/json", buffer: Buffer.from(JSON.stringify(document)) });
  await hasText("#campaign-plan", "Dry run of morning");
  await hasText("#campaign-plan", "k0 to 3 %");
  await page.click("#campaign-plan summary");
  seen.plan = await text("#campaign-plan");
  await page.click("#campaign-start-test");
  await hasText("#campaign-start-note", "it has no recipients");
  const told = { ...document, notify: [{ mailto: "night@example.org" }] };
  await give(JSON.stringify(told));
  await hasText("#campaign-plan", "Dry run of morning");
  await page.click("#campaign-start-test");
  await hasText("#campaign-start-note", "was sent to all recipients");
  seen.startsAfterTest = await page.locator("#campaign-begin").isEnabled();
  await check("start");
  await page.fill("#campaign-operator", "M. Curie");
  await page.click("#campaign-begin");
  await hasText("#campaign-facts", "quick on MR-0042");
  seen.begun = [new URL(page.url()).hash, await page.evaluate(() => document.activeElement.id)];
}

async function readEnded() {
  await page.goto(`${url}/#/campaigns/short-1`);
  await hasText("#campaign-facts", "stopped on request");
  seen.endedMessages = await page.locator("#campaign-messages li").first().innerText();
  seen.endedControls = await page.evaluate(() => ["pause", "resume", "stop"].map((verb) => document.getElementById(`campaign-${verb}`).disabled));
  await check("ended");
  await page.click("#campaign-report-html");
  await hasText("#campaign-result", "No report was made");
  seen.refusedReport = await text("#campaign-result");
  await page.goto(`${url}/#/campaigns/none`);
  await hasText("#campaign-note", "Campaigns cannot be shown");
  await page.click(".views a[data-view=campaigns]");
  await hasText("#view-campaigns h1", "Campaigns"); // the hidden list still has the text of its last visit
  seen.titleOfList = await text("#view-campaigns h1");
}

try {
  for (const step of [walk, readBoard, answerPrompt, editQueue, sendTest, saveReports, stopInDialog, control, begin, readEnded]) await step();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

// Reads the results of a run in the page, keeps records on it and starts its next stroke; prints the observations as JSON:
//   node read_run.mjs URL TOKEN CHROMIUM

import { makeWaits, openPage } from "./browser.mjs";
import { makeChecks } from "./page_checks.mjs";

const [url, token, chromium] = process.argv.slice(2);
const seen = { errors: [], violations: {}, small: {}, overflow: {} };
const { page, close } = await openPage(chromium, { width: 1400, height: 900 });
page.on("pageerror", (error) => seen.errors.push(String(error)));
const { audit, findSmall, findOverflow } = makeChecks(page);

const { hasText } = makeWaits(page);

async function readResults() {
  await page.goto(`${url}/#token=${token}`);
  await hasText("#state-word", "Idle");
  await page.goto(`${url}/#/runs/run-1`);
  await hasText("#run", "RMSE 4.1 N");
  seen.residuals = await part("Residual by condition").locator("tbody tr").allInnerTexts();
  seen.diagnosis = await page.getByRole("region", { name: "Diagnosis" }).innerText();
  seen.nextStroke = await page.getByRole("region", { name: "Next stroke" }).innerText();
  await page.setViewportSize({ width: 390, height: 844 });
  await page.waitForTimeout(300);
  seen.overflow.telephone = await findOverflow();
  seen.small.telephone = await findSmall();
  await page.setViewportSize({ width: 1400, height: 900 });
}

/** Table with a caption that begins with some words, inside its group. */
const part = (words) => page.locator("#run [role=group]", { has: page.locator("caption", { hasText: words }) });
const labels = () => page.locator("#run .curves [role=img]").evaluateAll((all) => all.map((one) => one.getAttribute("aria-label")));
const inked = () => page.locator("#run .curves canvas").evaluateAll((all) => all.map((one) => one.width > 100));

/** Chooses another segment and a prediction instead of the fit, and other units. */
async function chooseForce() {
  seen.figures = await labels();
  seen.drawn = await inked();
  seen.segment = await page.getByLabel("Segment").evaluate((select) => select.selectedOptions[0].innerText);
  await page.getByLabel("Segment").selectOption({ index: 0 });
  await hasText("#run", "10mm_1Hz_0V: RMSE 2.55 N");
  await page.getByLabel("Simulated by").selectOption({ index: 1 });
  await hasText("#run", "10mm_1Hz_0.2V: RMSE 5.08 N");
  await page.selectOption("#unit-force", "lbf");
  await hasText("#run", "10mm_1Hz_0.2V: RMSE 1.14 lbf");
  seen.figuresInLbf = await labels();
  await page.selectOption("#unit-force", "N");
}

/** Adds a tag, first refused because another person was faster, and a note; opens the files. */
async function keepRecords() {
  const notes = page.getByRole("region", { name: "Notes and tags" });
  await notes.getByLabel("Your name").fill("E. Noether");
  await notes.getByLabel("New tag").fill("seal");
  await notes.getByRole("button", { name: "Add tag" }).click();
  await notes.getByText("Not changed").waitFor();
  seen.refusedTag = await notes.locator("p[role=status]").innerText();
  await page.keyboard.press("Enter");
  await notes.getByText("The tag seal was added.").waitFor();
  await notes.getByLabel("Note", { exact: true }).fill("Warm before the run.");
  await notes.getByRole("button", { name: "Add note" }).click();
  await notes.getByText("The note was added.").waitFor();
  seen.notes = await notes.locator(".notes li").allInnerTexts();
  seen.tags = await notes.locator(".tags span").allInnerTexts();
  const files = page.getByRole("region", { name: "Files" });
  await files.locator("summary").click();
  await files.locator("table").waitFor();
  seen.files = await files.locator("tbody tr").allInnerTexts();
  const events = page.getByRole("region", { name: "Events", exact: true });
  await events.locator("summary").press("Enter");
  await events.locator("table").waitFor();
  seen.events = await events.locator("tr").allInnerTexts();
  seen.violations.records = await audit();
  seen.small.records = await findSmall();
}

/** Moves a run to the trash and back; the question leaves Stop usable, and Escape answers no. */
async function trashAndRestore() {
  const move = page.getByRole("button", { name: /^Move to trash …/ });
  await move.click();
  seen.question = await page.locator("#question-dialog").innerText();
  seen.violations.question = await audit();
  seen.stopInQuestion = await page.locator("#stop").isEnabled();
  await page.keyboard.press("Escape");
  await page.locator("#question-dialog").waitFor({ state: "hidden" });
  seen.keptAfterEscape = !(await page.locator("#run").innerText()).includes("In the trash since");
  await move.click();
  await page.click("#question-agree");
  await hasText("#run", "In the trash since");
  seen.actionsInTrash = await page.locator("#run .actions").first().innerText();
  await page.getByRole("button", { name: /^Restore/ }).click();
  await hasText("#run", "The run was restored.");
}

/** Opens runs that lack results, and reads what the page says instead. */
async function openIncomplete() {
  seen.missing = {};
  for (const id of ["run-0", "run-2", "run-3"]) {
    await page.goto(`${url}/#/runs/${id}`);
    await hasText("#run", "No diagnosis");
    seen.missing[id] = await page.locator("#run .folded > .soft:first-child").allInnerTexts();
    seen.violations[id] = await audit();
  }
}

/** Starts the method again with the proposed stroke: refused at first, then running. */
async function startNextStroke() {
  await page.goto(`${url}/#/runs/run-1`);
  await hasText("#run", "Proposed next stroke");
  const section = page.getByRole("region", { name: "Next stroke" });
  const press = async () => {
    await section.getByRole("button").click();
    await page.locator("#question-dialog").waitFor();
    seen.startQuestion = await page.locator("#question-dialog").innerText();
    await page.click("#question-agree");
  };
  await press();
  await section.getByText("Not started").waitFor();
  seen.refusedStart = await section.locator("p[role=status]").innerText();
  await press();
  await page.waitForFunction(() => document.activeElement.id === "stop");
  seen.afterStart = [new URL(page.url()).hash, await page.evaluate(() => document.activeElement.id)];
}

try {
  for (const step of [readResults, chooseForce, keepRecords, trashAndRestore, openIncomplete, startNextStroke]) await step();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

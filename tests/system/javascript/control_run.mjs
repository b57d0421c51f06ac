// Pauses, aborts and resumes a run at the page, retries a job and checks a log, and prints what is shown as JSON:
//   node control_run.mjs URL TOKEN CHROMIUM

import { openPage } from "./browser.mjs";

const [url, token, chromium] = process.argv.slice(2);
const { page, close } = await openPage(chromium, { width: 820, height: 1180 });
const seen = { errors: [], buttons: {} };
page.on("pageerror", (error) => seen.errors.push(String(error)));

const hasState = (word) =>
  page.waitForFunction((wanted) => document.getElementById("state-word").innerText === wanted, word);
const shows = (id, text) =>
  page.waitForFunction(([place, wanted]) => document.getElementById(place).innerText.includes(wanted), [id, text]);
const visible = async () => {
  const shown = [];
  for (const id of ["pause", "abort", "reset"]) if (await page.locator(`#${id}`).isVisible()) shown.push(id);
  return shown;
};

/** Sends a request as another client of the service would. */
const post = (path, body) => fetch(`${url}/api/v1/${path}`, {
  method: "POST", headers: { Authorization: `Bearer ${token}`, "Content-Type": "application/json" }, body: JSON.stringify(body),
});

try {
  await page.goto(`${url}/#token=${token}`);
  await hasState("Idle");
  seen.buttons.idle = await visible();
  await post("runs", {}); // the first start is refused
  await post("runs", { method: "quick", specimen: "MR-0042", operator: "" });
  await hasState("Running");
  seen.buttons.running = await visible();
  seen.heights = await page.locator("#pause, #abort").evaluateAll((all) => all.map((one) => one.getBoundingClientRect().height));
  await page.click("#pause");
  await shows("bar-line", "Pause: ");
  seen.pause = await page.locator("#bar-line").innerText();
  seen.pauseDisabled = await page.locator("#pause").isDisabled();
  seen.resumeWhileRunning = await page.locator("#resume").isVisible();
  await post("checkpoint");
  await hasState("Idle");
  await shows("start-note", "Resume continues it");
  seen.paused = await page.locator("#start-note").innerText();
  seen.places = await page.locator("#start, #resume").evaluateAll((all) => all.map((one) => {
    const { y, height } = one.getBoundingClientRect();
    return [y, height];
  }));
  await page.click("#resume");
  await hasState("Running");
  seen.focused = await page.evaluate(() => document.activeElement.id);
  seen.resumeAfterwards = await page.locator("#resume").isVisible();
  await page.click("#abort");
  await hasState("Tripped");
  seen.buttons.tripped = await visible();
  await post("bench/reset");
  await hasState("Idle");

  await page.goto(`${url}/#/runs/run-3`);
  await page.click("button:has-text('Retry identify')");
  seen.question = await page.locator("#question-texts").innerText();
  await page.keyboard.press("Enter"); // refused without a reason
  seen.keptOpen = await page.locator("#question-dialog").isVisible();
  await page.click("#question-dialog button[value=cancel]");
  await page.locator("#question-dialog").waitFor({ state: "hidden" });
  await page.click("button:has-text('Retry identify')");
  await page.getByLabel("Reason for the repetition").fill(" more memory ");
  await page.keyboard.press("Enter");
  await shows("run", "was queued again");
  await page.click("button:has-text('Check log')");
  await shows("run", "The log is changed");
  seen.facts = await page.locator("#run").innerText();
  await page.click("#run button:has-text('Resume')");
  await hasState("Running");
  seen.address = new URL(page.url()).hash;

  await page.click(".views a[data-view=runs]");
  await shows("runs", "run");
  await page.click("#search-more summary");
  await page.selectOption("[name=outcome]", "lossy");
  await page.fill("[name=from]", "2025-03-04");
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => document.querySelectorAll("#runs tr").length === 1);
  seen.found = await page.locator("#runs tr").innerText();
  seen.search = new URL(page.url()).hash;
  await page.reload();
  await shows("runs-title", "Found");
  seen.kept = await page.inputValue("[name=outcome]");
  await page.fill("#search-form [name=specimen]", "nothing");
  await page.click("#search-form button.primary");
  await shows("runs-note", "No run meets all conditions.");
  await page.click("#search-clear");
  await page.waitForFunction(() => document.querySelectorAll("#runs tr").length > 3);
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

// Opens each dialog of the page while somebody else starts a run, tries to stop it, and prints the observations as JSON:
//   node stop_in_dialogs.mjs URL TOKEN CHROMIUM

import { openPage } from "./browser.mjs";

const [url, token, chromium] = process.argv.slice(2);
const { page, close } = await openPage(chromium, { width: 820, height: 1180 });
const seen = { errors: [], stops: {}, left: {} };
page.on("pageerror", (error) => seen.errors.push(String(error)));

const hasState = (word) =>
  page.waitForFunction((wanted) => document.getElementById("state-word").innerText === wanted, word);
const isOpen = (id) => page.locator(`#${id}`).evaluate((dialog) => dialog.open);

/** Sends a request as another client of the service would. */
async function post(path, body) {
  await fetch(`${url}/api/v1/${path}`, {
    method: "POST", headers: { Authorization: `Bearer ${token}`, "Content-Type": "application/json" }, body: JSON.stringify(body),
  });
}

const OPENING = {
  "home-dialog": { state: "Idle", open: () => page.click("[data-step=home]") },
  "reset-dialog": { state: "Tripped", open: () => page.click("#reset") },
};
const WAYS = {
  Escape: () => page.keyboard.press("Escape"),
  Space: () => page.keyboard.press("Space"),
  click: () => page.click("#stop"),
};

async function isStopped(act) {
  const request = page.waitForRequest((one) => one.method() === "POST" && one.url().endsWith("/stop"), { timeout: 5_000 });
  await act();
  return request.then(() => true, () => false);
}

async function stopIn(id, way) {
  const { state, open } = OPENING[id];
  if (state === "Idle") await post("bench/reset");
  await hasState(state);
  await open();
  await post("runs", { method: "quick", specimen: "MR-0042", operator: "another person" });
  await hasState("Running");
  const stopped = await isStopped(WAYS[way]);
  seen.stops[`${id} ${way}`] = [stopped, await isOpen(id)];
  await hasState("Tripped");
  await page.keyboard.press("Escape");
  seen.left[`${id} ${way}`] = !(await isOpen(id));
}

/** Lets the session end during a run, so that the page asks to sign in again. */
async function stopWhileSignInIsAsked() {
  await post("runs", { method: "quick", specimen: "MR-0042", operator: "another person" });
  await hasState("Running");
  await page.route("**/api/v1/bench", (route) => route.fulfill({ status: 401, json: { title: "Not allowed", detail: "" } }));
  await post("silence");
  await page.waitForFunction(() => document.getElementById("sign-in-dialog").open);
  seen.stops["sign-in-dialog Escape"] = [await isStopped(WAYS.Escape), await isOpen("sign-in-dialog")];
}

try {
  await page.goto(`${url}/#token=${token}`);
  await hasState("Idle");
  await page.click("#preparation summary");
  await post("runs", {}); // the first start is refused
  for (const way of Object.keys(WAYS)) await stopIn("home-dialog", way);
  for (const way of Object.keys(WAYS)) await stopIn("reset-dialog", way);
  await stopWhileSignInIsAsked();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

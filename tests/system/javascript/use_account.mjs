// Signs in by each way, as people with different roles, and uses people and tokens; prints the observations as JSON:
//   node use_account.mjs URL TOKEN CHROMIUM [FOLDER FOR PICTURES]

import { makeWaits, openPage } from "./browser.mjs";
import { makeChecks } from "./page_checks.mjs";

const [url, token, chromium, folder] = process.argv.slice(2);
const WIDTHS = [1400, 390]; // between them, nothing of these dialogs and views changes its order
const PASSWORD = "correct horse battery";
const seen = { errors: [], findings: {}, described: {} };
const { page, close } = await openPage(chromium, { width: 1400, height: 900 });
page.on("pageerror", (error) => seen.errors.push(String(error)));
const { inspect } = makeChecks(page);
const { until, hasText } = makeWaits(page);
const text = (selector) => page.locator(selector).innerText();
const api = (path, method = "GET", body = undefined) => fetch(`${url}/api/v1/${path}`, {
  method, headers: { Authorization: `Bearer ${token}`, "Content-Type": "application/json" }, body: body && JSON.stringify(body),
});
const stored = () => page.evaluate(() => JSON.stringify([{ ...localStorage }, { ...sessionStorage }, document.cookie]));

/** Inspects the page as it is, and keeps pictures of it if a folder is given. */
async function look(name) {
  seen.findings[name] = await inspect(WIDTHS);
  if (!folder) return;
  for (const [width, colorScheme] of [[1400, "light"], [1400, "dark"], [820, "light"], [390, "dark"]]) {
    await page.setViewportSize({ width, height: 1000 });
    await page.emulateMedia({ colorScheme });
    await page.screenshot({ path: `${folder}/${name}-${width}-${colorScheme}.png` });
  }
  await page.setViewportSize({ width: 1400, height: 900 });
  await page.emulateMedia({ colorScheme: "light" });
}

async function signIn(name, password = PASSWORD) {
  await page.locator("#sign-in-dialog").waitFor();
  await page.fill("#sign-in-name", name);
  await page.fill("#password", password);
  await page.keyboard.press("Enter");
}

async function choose(item) {
  await page.click("#account");
  await page.getByRole("menuitem", { name: item }).click();
}

async function signOut() {
  await choose("Sign out");
  await page.locator("#sign-in-dialog").waitFor();
}

/** Three wrong passwords, then a wait that counts down. */
async function failAndWait() {
  await page.goto(`${url}/#/runs/run-1`);
  await page.locator("#sign-in-dialog").waitFor();
  seen.firstReason = await text("#sign-in-reason");
  await look("sign-in");
  await signIn("lmeitner", "wrong");
  await hasText("#sign-in-reason", "Not signed in");
  seen.refused = await text("#sign-in-reason");
  for (let k = 0; k < 3; k++) {
    await page.fill("#password", "wrong");
    await page.keyboard.press("Enter");
    await until(() => document.getElementById("password").value === "");
  }
  await hasText("#sign-in-wait", "Next attempt in");
  seen.wait = await text("#sign-in-wait");
  seen.locked = await page.locator("#sign-in").isDisabled();
  await until(() => !document.getElementById("sign-in").disabled);
  await signIn("lmeitner");
  await hasText("#run", "Residual by condition");
  seen.addressAfterSignIn = new URL(page.url()).hash;
  seen.account = await text("#account");
  seen.stored = await stored();
}

/** A technician: what is disabled and why, and the operator's name. */
async function beTechnician() {
  await page.reload();
  await hasText("#run", "Residual by condition");
  const trash = page.getByRole("button", { name: /^Move to trash/ });
  seen.described.trash = await describe(trash);
  await trash.click({ force: true }); // a person can touch what is disabled
  await hasText("#bar-detail", "manage_runs");
  seen.detail = await text("#bar-detail");
  seen.asked = await page.locator("#question-dialog").isVisible();
  await page.goto(`${url}/#/bench`);
  await hasText("#methods", "quick");
  seen.operator = await page.inputValue("#operator");
  await page.fill("#specimen", "MR-0042");
  await page.click("#start"); // the fake bench refuses the first start
  await hasText("#start-note", "Not started");
  await page.click("#start");
  await hasText("#state-word", "Running");
  await signOut();
}

const describe = (control) => control.evaluate((one) => ({
  disabled: one.getAttribute("aria-disabled"),
  text: (one.getAttribute("aria-describedby") ?? "").split(" ").filter(Boolean).map((id) => document.getElementById(id).textContent).join(" "),
}));

/** A viewer during a run: cannot start or pause, but stops. */
async function beViewer() {
  await signIn("vguest");
  await hasText("#state-word", "Running");
  for (const id of ["pause", "import", "start"]) seen.described[id] = await describe(page.locator(`#${id}`));
  for (const id of ["stop", "abort"]) seen.described[id] = await describe(page.locator(`#${id}`));
  await look("viewer");
  await page.click("#stop");
  await hasText("#state-word", "Tripped");
  seen.described.reset = await describe(page.locator("#reset"));
  await page.goto(`${url}/#/people`);
  await hasText("#people-note", "right administer");
  seen.people403 = await text("#people-note");
  await api("bench/reset", "POST");
  await signOut();
}

/** The keyboard in the menu. */
async function walkMenu() {
  await signIn("mcurie");
  await hasText("#account", "Marie Curie");
  await hasText("#state-word", "Idle");
  await page.locator("#account").focus();
  const walked = [];
  for (const key of ["ArrowDown", "ArrowDown", "End", "ArrowDown", "ArrowUp", "Home"]) {
    await page.keyboard.press(key);
    walked.push(await page.evaluate(() => document.activeElement.innerText));
  }
  seen.walked = walked;
  await look("menu");
  await page.keyboard.press("Escape");
  seen.afterEscape = await page.evaluate(() => [document.activeElement.id, document.getElementById("account-menu").hidden]);
}

async function managePeople() {
  await choose("People");
  await hasText("#people", "Lise Meitner");
  await page.click("#add-person");
  await page.fill("#person-name", "enoether");
  await page.fill("#person-full-name", "Emmy Noether");
  await page.selectOption("#person-role", "technician");
  await page.getByLabel("reset after a trip").check();
  await page.fill("#person-password", "symmetry and laws");
  await look("add-person");
  await page.locator("#person-password").focus();
  await page.keyboard.press("Enter");
  await hasText("#people-note", "was added");
  await changeExternal();
  await page.getByRole("button", { name: "Set password … Emmy Noether" }).click();
  await page.fill("#new-password", "conserved quantity");
  await page.fill("#repeated-password", "conserved quantities");
  await page.keyboard.press("Enter");
  await hasText("#password-note", "differ");
  await page.fill("#repeated-password", "conserved quantity");
  await page.keyboard.press("Enter");
  await hasText("#people-note", "The password of Emmy Noether was set");
  await page.getByRole("button", { name: "Disable … Lise Meitner" }).click();
  await page.click("#question-agree");
  await hasText("#people-note", "Lise Meitner was disabled");
  await page.getByRole("button", { name: "Disable … Marie Curie" }).click();
  await page.click("#question-agree");
  await hasText("#people-note", "last administrator");
  seen.lastAdministrator = await text("#people-note");
  seen.people = await page.locator("#people tr").allInnerTexts();
  await look("people");
}

/** A person of the identity provider: what comes from there is neither shown as a field nor sent. */
async function changeExternal() {
  seen.external = await page.locator("#people tr", { hasText: "Wolfgang Pauli" }).innerText();
  await page.getByRole("button", { name: "Change … Wolfgang Pauli" }).click();
  seen.externalFields = await page.locator("#person-form").evaluate((form) =>
    [...form.querySelectorAll("label")].filter((one) => one.checkVisibility()).map((one) => one.innerText.trim()));
  seen.externalWords = await text("#person-external");
  await page.getByLabel("store methods").check();
  await look("external");
  await page.getByRole("button", { name: "Save" }).click();
  await hasText("#people-note", "Wolfgang Pauli was changed");
}

/** Approves a version of a method, and withdraws the approval. */
async function approveMethod() {
  await page.goto(`${url}/#/plan/quick`);
  await hasText("#plan", "version 2");
  const versions = page.getByRole("group", { name: "Versions and approval" });
  const act = async (name, words) => {
    await versions.getByRole("button", { name }).click();
    seen.approvalQuestion = await text("#question-dialog");
    await page.click("#question-agree");
    await versions.getByText(words).waitFor();
    return versions.locator("tbody tr").allInnerTexts();
  };
  seen.approved = await act("Approve … version 2 of quick", "Version 2 was approved.");
  await look("approval");
  seen.withdrawn = await act("Withdraw the approval … version 2 of quick", "The approval of version 2 was withdrawn.");
}

/** Reads a report and signs it, first with a wrong password. */
async function signReport() {
  await page.goto(`${url}/#/runs/run-1`);
  await hasText("#run", "Residual by condition");
  const section = page.getByRole("region", { name: "Signatures" });
  await section.locator("summary").click();
  await section.getByText("Newer results exist").waitFor();
  seen.signedBefore = await section.locator("tbody tr").allInnerTexts();
  await section.getByRole("button", { name: "Make the report to sign" }).click();
  await section.frameLocator("iframe").getByText("Report 1 on run-1").waitFor();
  seen.toBeSigned = await section.locator(".folded > .path").innerText();
  await section.getByRole("button", { name: "Sign this report …" }).click();
  await page.selectOption("#sign-meaning", "approved");
  await page.fill("#sign-password", "not this one");
  await page.keyboard.press("Enter");
  await hasText("#sign-report-dialog [role=alert]", "Not signed");
  seen.wrongSignature = await text("#sign-report-dialog [role=alert]");
  seen.signDialog = await text("#sign-report-dialog");
  await look("sign");
  await page.fill("#sign-password", PASSWORD);
  await page.keyboard.press("Enter");
  await section.getByText("Signed: approved").waitFor();
  seen.signed = await section.locator("p[role=status]").innerText();
  seen.signedAfter = await section.locator("tbody tr").allInnerTexts();
  await section.scrollIntoViewIfNeeded();
  await look("signatures");
}

/** Reads, searches, verifies and exports the audit trail. */
async function readTrail() {
  await choose("Audit trail");
  await hasText("#audit", "local:rig");
  const rows = () => page.locator("#audit > tr").allInnerTexts();
  seen.trail = await rows();
  await look("audit");
  await page.click("#audit-older");
  await until(() => document.getElementById("audit").childElementCount > 50);
  seen.wholeTrail = (await rows()).length;
  await page.click("#audit-verify button.primary");
  await hasText("#audit-answer", "Nothing was altered");
  seen.verified = await text("#audit-answer");
  const [saved] = await Promise.all([page.waitForEvent("download"), page.click("#audit-export-csv")]);
  seen.exported = saved.suggestedFilename();
  await page.selectOption("#audit-form [name=action]", "report signed");
  await page.fill("#audit-form [name=actor]", "user:mcurie");
  await page.fill("#audit-form [name=from]", "2025-03-05T08:00");
  await page.keyboard.press("Enter");
  await until(() => document.getElementById("audit").childElementCount === 1);
  seen.found = [await rows(), new URL(page.url()).hash];
  await page.reload();
  await hasText("#audit", "report signed");
  seen.kept = [await page.inputValue("#audit-form [name=from]"), await page.inputValue("#audit-form [name=actor]")];
}

async function manageTokens() {
  await choose("Tokens");
  await hasText("#tokens", "nightly export");
  await page.fill("#token-label", "grafana");
  await page.selectOption("#token-role", "viewer");
  await page.fill("#token-days", "30");
  await page.keyboard.press("Enter");
  await page.locator("#token-new").waitFor();
  seen.newToken = await page.inputValue("#new-token");
  await page.click("#token-copy");
  await hasText("#token-copied", "oken");
  seen.copied = await text("#token-copied");
  await look("tokens");
  await page.click("#token-hide");
  seen.hidden = [await page.inputValue("#new-token"), await page.locator("#token-new").isVisible()];
  await page.getByRole("button", { name: "Revoke grafana" }).click();
  await page.click("#question-agree");
  await hasText("#tokens-note", "was revoked");
  seen.tokens = await page.locator("#tokens tr").allInnerTexts();
}

async function changePassword() {
  await choose("Change my password");
  await page.fill("#current-password", "not this one");
  for (const id of ["new-password", "repeated-password"]) await page.fill(`#${id}`, "polonium and radium");
  await page.keyboard.press("Enter");
  await hasText("#password-note", "Not saved");
  seen.wrongPassword = await text("#password-note");
  await look("password");
  await page.fill("#current-password", PASSWORD);
  await page.keyboard.press("Enter");
  await page.locator("#password-dialog").waitFor({ state: "hidden" });
}

/** Another device signs in by the address of the QR code, and one by typed digits. */
async function signInDevices() {
  await choose("Sign in another device");
  await hasText("#device-time", "Valid for");
  seen.deviceTime = await text("#device-time");
  seen.picture = await page.locator("#device-picture").evaluate((image) => image.decode().then(() => image.naturalWidth > 0));
  await look("device");
  const shown = await text("#device-code");
  seen.scanned = await openDevice(`#code=${shown.replace("-", "")}`, async () => {});
  await page.click("#device-again");
  await until((old) => /\d/.test(document.getElementById("device-code").innerText) && document.getElementById("device-code").innerText !== old, shown);
  const typed = await text("#device-code");
  seen.typed = await openDevice("#/tokens", async (device) => {
    await device.check("input[value=code]");
    await device.fill("#code", typed);
    await device.keyboard.press("Enter");
  });
  await page.keyboard.press("Escape");
}

async function openDevice(hash, act) {
  const device = await openPage(chromium, { width: 390, height: 800 });
  try {
    await device.page.goto(`${url}/${hash}`);
    await act(device.page);
    await device.page.waitForFunction(() => document.getElementById("account").innerText.includes("Marie Curie"));
    return new URL(device.page.url()).hash;
  } finally {
    await device.close();
  }
}

/** The session ends meanwhile; another person signs in, in a tab beside this one. */
async function loseSession() {
  await page.goto(`${url}/#/specimens`);
  await page.locator("#specimens-note").waitFor({ state: "attached" });
  await api("expire", "POST");
  await page.locator(".views a[data-view=runs]").click();
  await page.locator(".views a[data-view=specimens]").click();
  await page.locator("#sign-in-dialog").waitFor();
  seen.expired = await text("#sign-in-reason");
  await signIn("mcurie", "polonium and radium");
  await page.locator("#sign-in-dialog").waitFor({ state: "hidden" });
  seen.addressAfterExpiry = new URL(page.url()).hash;
  await page.evaluate((password) => fetch("/api/v1/session", {
    method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ name: "vguest", password }),
  }), PASSWORD);
  await page.evaluate(() => { location.hash = "#/tokens"; });
  await hasText("#tokens", "nightly export");
  await page.fill("#token-label", "from another tab");
  await page.keyboard.press("Enter");
  await hasText("#account", "Visiting Guest"); // the page follows the session of the cookie
  await hasText("#tokens", "from another tab");
  seen.creator = await page.locator("#tokens tr").first().innerText();
}

try {
  const steps = [failAndWait, beTechnician, beViewer, walkMenu, managePeople, approveMethod, signReport, readTrail, manageTokens, changePassword, signInDevices, loseSession];
  for (const step of steps) await step();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

// Takes the pictures of the documentation on the page of a real service, and writes them to a folder as PNG:
//   node take_screenshots.mjs URL#token=... FOLDER CHROMIUM '{"user": NAME, "password": P, "campaign": ID}' [NAME...]
// A name is that of a function below, which may take several pictures. Without names all are called but `question`,
// which needs a campaign that waits for a person.

import { makeWaits, openPage } from "./browser.mjs";

const [address, folder, chromium, shown, ...names] = process.argv.slice(2);
const [url, token] = address.split("/#token=");
const { user, password, campaign } = JSON.parse(shown);
const SIZE = { width: 1280, height: 800 };
const TABLET = { width: 820, height: 1180 };
/** Time [ms] of a dry run or a report, and of what a run needs to fill the live plots. */
const SLOW = 300_000;
const { page, close } = await openPage(chromium, SIZE);
const { until, hasText } = makeWaits(page);

const ask = async (path, method = "GET") =>
  (await fetch(`${url}/api/v1/${path}`, { method, headers: { Authorization: `Bearer ${token}` } })).json();
const take = (name) => page.screenshot({ path: `${folder}/${name}.png` });
const open = async (hash, selector, words, timeout) => {
  await page.goto(`${url}/${hash}`);
  await hasText(selector, words, timeout);
};
/** Scrolls an element to the upper edge, below the bar that stays there. */
const show = (selector) => page.locator(selector).first().evaluate((one) => {
  const bar = document.querySelector(".bar").getBoundingClientRect().height;
  scrollBy(0, one.getBoundingClientRect().top - bar - 8);
});
const section = (name) => `section[aria-label="${name}"]`;

/** Returns the newest run of a specimen and method with a stored result, by default the diagnosis. */
async function findRun(specimen, method, result = "diagnose") {
  const { items } = await ask(`runs?specimen=${specimen}&method=${method}&outcome=clean`);
  return items.find(({ jobs }) => jobs.some(({ kind, state }) => kind === result && state === "done")).id;
}

/** Starts a run in the page and waits until its plots are full. */
async function startRun() {
  await open("#/bench", "#state-word", "Idle");
  await page.check("input[value=six_voltages]");
  await page.fill("#specimen", "MR-0042");
  await page.fill("#operator", "L. Meitner");
  await page.click("#start");
  await hasText("#state-word", "Running");
  await until(() => Number(document.querySelector("#progress").value) > 0.35, null, SLOW);
  await show("#live");
}

/** A run in progress: light, dark, on a tablet, below a dialog, and aborted. */
async function bench() {
  await startRun();
  await take("bench");
  await page.emulateMedia({ colorScheme: "dark" });
  await take("bench-dark");
  await page.emulateMedia({ colorScheme: "light" });
  await page.setViewportSize(TABLET);
  await page.waitForTimeout(1_000); // the plots follow the size
  await show("#live");
  await take("bench-tablet");
  await page.setViewportSize(SIZE);
  await page.click("#import");
  await take("import");
  await page.locator("dialog[open] button", { hasText: "Close" }).click();
  await page.evaluate(() => scrollTo(0, 0));
  await page.click("#abort");
  await hasText("#state-word", "Tripped");
  await take("trip");
  await ask("bench/reset", "POST");
  await hasText("#state-word", "Idle");
}

async function plan() {
  await open("#/plan/quick", "#plan", "standard deviation", SLOW);
  await take("plan");
  await show(".forecast");
  await take("forecast");
}

async function runs() {
  await open("#/runs?specimen=MR-0042", "#runs", "MR-0042");
  await page.locator("#search-more").evaluate((one) => { one.open = true; });
  await take("runs");
}

async function run() {
  const id = await findRun("MR-0042", "quick");
  await open(`#/runs/${id}`, section("Diagnosis"), "probability", SLOW);
  await take("run");
  for (const [name, part] of [["diagnosis", "Diagnosis"], ["force", "Measured over simulated"], ["parameters", "Parameters and force error by drive"]]) {
    await page.waitForTimeout(2_000); // the figures above and in it are loaded
    await show(section(part));
    await take(name);
  }
}

async function replay() {
  const id = await findRun("MR-0042", "quick");
  await open(`#/runs/${id}/replay`, "#run", "not live");
  await page.locator(".timeline input").fill("12");
  await until(() => document.querySelectorAll("#run .readings > div").length > 2);
  await page.waitForTimeout(2_000); // samples of the last ten seconds are loaded
  await take("replay");
}

async function compare() {
  const [first, second] = [await findRun("MR-0042", "quick"), await findRun("MR-0107", "quick", "identify")];
  await open(`#/compare?run=${first}&run=${second}&reference=${first}`, section("Peak force against velocity"), "", SLOW);
  await page.waitForTimeout(2_000); // figures are drawn
  await show(section("Overlay of one stroke, cycles aligned by phase"));
  await take("compare");
}

async function specimen() {
  await open("#/specimens/MR-0042?quantity=fit.k0", "#specimen-parts .drift", "");
  await page.waitForTimeout(2_000);
  await show("#specimen-parts section:nth-of-type(2)");
  await take("specimen");
}

/** A campaign that waits for a person. */
async function question() {
  await open(`#/campaigns/${campaign}`, "#campaign-question", "Note");
  await take("campaign-question");
  await show("section[aria-labelledby=campaign-matrix-title]");
  await take("campaign");
}

async function report() {
  await open(`#/campaigns/${campaign}`, "#campaign-matrix", "quick");
  await show("section[aria-labelledby=campaign-trends-title]");
  await take("campaign-trends");
  const text = await fetch(`${url}/api/v1/campaigns/${campaign}/report`, { headers: { Authorization: `Bearer ${token}` } });
  await page.goto("about:blank");
  await page.setContent(await text.text());
  await take("campaign-report");
  await page.goto("about:blank"); // the next address is opened as a new page
}

async function people() {
  await open("#/people", "#people", "Marie Curie");
  await take("people");
}

async function signIn() {
  await page.goto(url);
  await page.fill("#sign-in-name", user);
  await page.fill("#password", password);
  if (names.length === 0) await take("sign-in");
  await page.click("#sign-in");
  await until(() => document.body.dataset.state && document.body.dataset.state !== "unknown");
}

const PICTURES = { bench, plan, runs, run, replay, compare, specimen, report, people };

try {
  await signIn();
  for (const name of names.length ? names : Object.keys(PICTURES)) await { ...PICTURES, question }[name]();
} finally {
  await close();
}

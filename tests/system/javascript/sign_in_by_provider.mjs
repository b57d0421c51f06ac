// Signs in by a provider on another site, in vain and in fact.
//
//     node sign_in_by_provider.mjs ADDRESS CHROMIUM FOLDER
//
// Prints what is seen, as JSON; screenshots are written to FOLDER.

import { openPage } from "./browser.mjs";

const [, , address, executable, folder] = process.argv;
const { page, close } = await openPage(executable, { width: 390, height: 844 });

/** Returns the reason in the dialog of the page once it has the button, and the address behind it. */
async function readDialog() {
  await button.waitFor();
  return page.evaluate(() => ({
    problem: document.querySelector("#sign-in-reason").textContent,
    hash: location.hash,
  }));
}

const session = () => page.evaluate(async () => (await fetch("/api/v1/session")).json());

const button = page.getByRole("link", { name: "Sign in with Lab account" });
const seen = {};
await page.goto(`${address}#/runs?specimen=S%201`);
await readDialog();
seen.height = (await button.boundingBox()).height;
await page.screenshot({ path: `${folder}/button.png` });
await button.click();
await page.waitForURL((url) => url.port === new URL(address).port);
seen.refused = await readDialog();
await page.screenshot({ path: `${folder}/problem.png` });
await button.click();
await page.getByRole("button", { name: /M. Curie|mcurie|Marie/ }).first().waitFor();
seen.view = await page.evaluate(() => location.hash);
seen.person = (await session()).person;
seen.cookies = await page.evaluate(() => document.cookie);
await page.evaluate(() => fetch("/api/v1/session").then((answer) => answer.json()).then(({ csrf }) =>
  fetch("/api/v1/session", { method: "DELETE", headers: { "X-CSRF-Token": csrf } })));
await page.goto("about:blank");
await page.goto(`${address}#problem=%3Cb%3E&view=/plan`);
seen.unknown = await readDialog();
await close();
console.log(JSON.stringify(seen));

// Signs in by a provider on another site, in vain and in fact.
//
//     node sign_in_by_provider.mjs ADDRESS CHROMIUM FOLDER
//
// Prints what is seen, as JSON; screenshots are written to FOLDER.

import { openPage } from "./browser.mjs";

const [, , address, executable, folder] = process.argv;
const { page, close } = await openPage(executable, { width: 390, height: 844 });

/** Opens a view with the button in a container of its own, and returns the sentence on the sign-in before. */
async function showButton(view) {
  await page.goto(`${address}${view}`);
  return addButton();
}

const addButton = () =>
  page.evaluate(async () => {
    const { addSignInWays, takeSignInProblem } = await import("/common/sign_in_ways.js");
    const container = document.createElement("p");
    container.id = "ways";
    const problem = takeSignInProblem();
    document.body.replaceChildren(problem, container);
    await addSignInWays(container);
    return { problem, hash: location.hash };
  });

const session = () => page.evaluate(async () => (await fetch("/api/v1/session")).json());

const seen = {};
await showButton("#/runs?specimen=S%201");
const button = page.getByRole("link", { name: "Sign in with Lab account" });
seen.height = (await button.boundingBox()).height;
await page.screenshot({ path: `${folder}/button.png` });
await button.click();
await page.waitForURL(/problem=/);
seen.refused = await addButton();
await page.screenshot({ path: `${folder}/problem.png` });
await button.click();
await page.waitForURL((url) => url.hash === "#/runs?specimen=S%201");
seen.person = (await session()).person;
seen.cookies = await page.evaluate(() => document.cookie);
await page.goto(`${address}#problem=%3Cb%3E&view=/plan`);
await page.reload();
seen.unknown = await addButton();
await close();
console.log(JSON.stringify(seen));

// Watches the state of a bench whose agent falls silent, over reconnections and a reload, and prints it as JSON:
//   node silent_bench.mjs URL TOKEN CHROMIUM

import { openPage } from "./browser.mjs";

const [url, token, chromium] = process.argv.slice(2);
const { page, close } = await openPage(chromium);
const seen = { errors: [] };
page.on("pageerror", (error) => seen.errors.push(String(error)));

/** Starts to note each state word with its time [s] in the page. */
const watch = () =>
  page.evaluate(() => {
    window.noted = [];
    const began = performance.now();
    setInterval(() => {
      const word = document.getElementById("state-word").innerText;
      if (window.noted.at(-1)?.[1] !== word) window.noted.push([(performance.now() - began) / 1000, word]);
    }, 20);
  });
const noted = () => page.evaluate(() => window.noted);
const look = () =>
  page.evaluate(() => ({
    line: document.getElementById("bar-line").innerText,
    marks: [...document.querySelectorAll("#instruments .mark")].map((mark) => [mark.className, mark.innerText]),
    numbers: [...document.querySelectorAll("#instruments tr")].map((row) => [2, 7].map((place) => row.children[place].innerText)),
    warnings: [...document.querySelectorAll("#warnings li")].map((one) => one.innerText),
    startDisabled: document.getElementById("start").disabled,
    liveAge: document.getElementById("live-age").innerText,
    segment: document.getElementById("segment").innerText,
    reference: document.getElementById("reference-state").innerText,
    steps: document.querySelectorAll("#prepare .done, #prepare [aria-current]").length,
    enabled: document.querySelectorAll("#prepare button:enabled").length,
    health: Object.fromEntries([...document.querySelectorAll("#health li")].map((one) => [
      one.firstChild.innerText, `${one.firstChild.className}: ${one.lastChild.textContent.trim()}`])),
  }));

await page.goto(`${url}/#token=${token}`);
await page.waitForFunction(() => document.getElementById("state-word").innerText === "Idle");
// On a busy machine the first status may come long before the first samples.
await page.waitForFunction(() => document.getElementById("live-age").innerText.startsWith("newest sample"));
await page.waitForFunction(() => document.getElementById("health").innerText.includes("Agent ready"));
seen.before = await look();
await watch();
await fetch(`${url}/api/v1/silence`, { method: "POST", headers: { Authorization: `Bearer ${token}` } });
await page.waitForTimeout(9_000); // longer than a silence after which the websocket was opened again
seen.words = await noted();
seen.after = await look();
await page.reload();
await watch();
// A busy machine may need seconds until the last status has arrived again.
await page.waitForFunction(
  () => Number(/No data for (\d+) s/.exec(document.getElementById("bar-line").innerText)?.[1]) >= 13, null, { timeout: 30_000 });
seen.wordsAfterReload = await noted();
seen.afterReload = await look();
await close();
console.log(JSON.stringify(seen));

// Prints what the page shows of the state, and each change of it, with its UTC [s], until standard input ends:
//   node watch_state.mjs ADDRESS CHROMIUM
// A line has the state word, the entries of the health, and the numbers of preparation steps done and of their enabled buttons.

import { openPage } from "./browser.mjs";

const [address, chromium] = process.argv.slice(2);
const { page, close } = await openPage(chromium);
await page.exposeFunction("report", (line) => console.log(line));
await page.goto(address);
await page.evaluate(() => {
  const state = document.getElementById("state-word");
  const health = document.getElementById("health");
  const prepare = document.getElementById("prepare");
  const find = () => ({
    word: state.innerText,
    health: Object.fromEntries([...health.children].map((one) => [one.firstChild.innerText, one.lastChild.textContent.trim()])),
    done: prepare.querySelectorAll(".done").length,
    enabled: prepare.querySelectorAll("button:enabled").length,
  });
  let last = "";
  const look = () => {
    const shown = find();
    if (JSON.stringify(shown) === last) return;
    last = JSON.stringify(shown);
    window.report(JSON.stringify({ utc_s: Date.now() / 1000, ...shown }));
  };
  const everything = { attributes: true, childList: true, characterData: true, subtree: true };
  for (const node of [state, health, prepare]) new MutationObserver(look).observe(node, everything);
  look();
});
process.stdin.resume();
process.stdin.on("end", async () => {
  await close();
  process.exit(0);
});

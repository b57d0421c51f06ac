// Prints each change of the state that the page shows, with its UTC [s], until standard input ends:
//   node watch_state.mjs ADDRESS CHROMIUM

import { openPage } from "../../tests/system/javascript/browser.mjs";

const [address, chromium] = process.argv.slice(2);
const { page, close } = await openPage(chromium);
await page.exposeFunction("report", (utc_s, word) => console.log(JSON.stringify({ utc_s, word })));
await page.goto(address);
await page.evaluate(() => {
  let last = null;
  const word = document.getElementById("state-word");
  new MutationObserver(() => {
    if (word.innerText !== last) window.report(Date.now() / 1000, (last = word.innerText));
  }).observe(word, { childList: true, characterData: true, subtree: true });
});
process.stdin.resume();
process.stdin.on("end", async () => {
  await close();
  process.exit(0);
});

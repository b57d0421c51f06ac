// Prints the state that the page shows, and each change of it, with its UTC [s], until standard input ends:
//   node watch_state.mjs ADDRESS CHROMIUM

import { openPage } from "./browser.mjs";

const [address, chromium] = process.argv.slice(2);
const { page, close } = await openPage(chromium);
await page.exposeFunction("report", (utc_s, word) => console.log(JSON.stringify({ utc_s, word })));
await page.goto(address);
await page.evaluate(() => {
  const node = document.getElementById("state-word");
  let last = null;
  const look = () => {
    if (node.innerText !== last) window.report(Date.now() / 1000, (last = node.innerText));
  };
  new MutationObserver(look).observe(node, { childList: true, characterData: true, subtree: true });
  look();
});
process.stdin.resume();
process.stdin.on("end", async () => {
  await close();
  process.exit(0);
});

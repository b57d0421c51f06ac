// Prints each change of the state that the page shows as a line of JSON, until standard input ends:
//   node watch_state.mjs URL TOKEN CHROMIUM

import { openPage } from "./browser.mjs";

const [url, token, chromium] = process.argv.slice(2);
const { page, close } = await openPage(chromium);
await page.exposeFunction("report", (word, utc_s) => console.log(JSON.stringify({ utc_s, word })));
await page.goto(`${url}/#token=${token}`);
await page.evaluate(() => {
  let last = null;
  setInterval(() => {
    const word = document.getElementById("state-word").innerText;
    if (word !== last) window.report((last = word), Date.now() / 1000);
  }, 20);
});
process.stdin.resume();
process.stdin.on("end", async () => {
  await close();
  process.exit(0);
});

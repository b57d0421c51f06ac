// Screenshot of the web page:
//   node screenshot.mjs URL#token=... FILE.png [--width 1280] [--height 800] [--dark] [--full] [--seconds 12] [--chromium PATH]
// `--seconds` is the time that the page has to fill its plots.

import { parseArgs } from "node:util";
import { openPage } from "./browser.mjs";

const { values, positionals: [url, file] } = parseArgs({
  allowPositionals: true,
  options: {
    width: { type: "string", default: "1280" },
    height: { type: "string", default: "800" },
    dark: { type: "boolean", default: false },
    full: { type: "boolean", default: false },
    seconds: { type: "string", default: "12" },
    chromium: { type: "string", default: "/usr/bin/chromium" },
  },
});
const { page, close } = await openPage(values.chromium, {
  width: Number(values.width), height: Number(values.height), colorScheme: values.dark ? "dark" : "light",
});
try {
  await page.goto(url);
  await page.waitForTimeout(Number(values.seconds) * 1000);
  await page.screenshot({ path: file, fullPage: values.full });
} finally {
  await close();
}

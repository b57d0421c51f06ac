// Checks a page from a file at several sizes and colour schemes, and prints the findings as JSON:
//   node audit_file.mjs FILE.html CHROMIUM

import { pathToFileURL } from "node:url";

import { openPage } from "./browser.mjs";
import { makeChecks } from "./page_checks.mjs";

const [file, chromium] = process.argv.slice(2);
const { page, close } = await openPage(chromium);
try {
  await page.goto(pathToFileURL(file).href);
  console.log(JSON.stringify(await makeChecks(page).inspect()));
} finally {
  await close();
}

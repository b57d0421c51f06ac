// Checks of a view at several sizes and in both colour schemes: axe-core, height of controls, sideways scrolling.

import { createRequire } from "node:module";

const AXE = createRequire(import.meta.url).resolve("axe-core/axe.min.js");
const WIDTHS = [1400, 820, 390];
const CONTROLS = "button, select, textarea, summary, nav a, a.button, a.link, tbody th a, input:not([type=radio], [type=checkbox]), label.check";

/** Returns what axe-core finds on the page as it is. */
export async function audit(page) {
  if (!(await page.evaluate(() => "axe" in window))) await page.addScriptTag({ path: AXE });
  const { violations } = await page.evaluate(() => window.axe.run(document, { iframes: false }));
  return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target).join(", ")}`);
}

/** Lists visible controls that are lower than a gloved thumb needs. */
const findSmall = (page) => page.evaluate((selector) => [...document.querySelectorAll(selector)]
  .filter((one) => one.checkVisibility() && one.getBoundingClientRect().height < 44)
  .map((one) => one.id || one.innerText || one.name), CONTROLS);

/** Returns all findings on a view, each with the size or scheme at which it shows. */
export async function inspect(page) {
  const found = [];
  for (const width of WIDTHS) {
    await page.setViewportSize({ width, height: 1180 });
    const overflow = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    if (overflow > 0) found.push(`${width}: ${overflow} px too wide`);
    for (const one of [...(await audit(page)), ...(await findSmall(page)).map((name) => `too low: ${name}`)]) found.push(`${width}: ${one}`);
  }
  await page.setViewportSize({ width: WIDTHS[0], height: 900 });
  await page.emulateMedia({ colorScheme: "dark" });
  for (const one of await audit(page)) found.push(`dark: ${one}`);
  await page.emulateMedia({ colorScheme: "light" });
  return found;
}

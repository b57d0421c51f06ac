// Checks of a page as it is: accessibility by axe-core, height of controls, need of a sideways scroll.

import { createRequire } from "node:module";

const AXE = createRequire(import.meta.url).resolve("axe-core/axe.min.js");
const CONTROLS = "button, select, textarea, nav a, a.button, tbody a, input:not([type=radio], [type=checkbox]), label.choice, label.check";

/** Lists what axe-core finds. */
export async function audit(page) {
  if (!(await page.evaluate(() => "axe" in window))) await page.addScriptTag({ path: AXE });
  const { violations } = await page.evaluate(() => window.axe.run(document, { iframes: false }));
  return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target).join(", ")}`);
}

/** Lists visible controls that are lower than a gloved thumb needs. */
export const findSmall = (page) => page.evaluate((controls) =>
  [...document.querySelectorAll(controls)]
    .filter((one) => one.checkVisibility() && one.getBoundingClientRect().height < 43.9)
    .map((one) => one.id || one.innerText), CONTROLS);

/** Returns by how many pixels the page is wider than its window. */
export const findOverflow = (page) => page.evaluate(() => document.documentElement.scrollWidth - innerWidth);

// Checks of the page as it is: findings of axe-core, too small controls, width beyond the screen.

import { createRequire } from "node:module";

const AXE = createRequire(import.meta.url).resolve("axe-core/axe.min.js");
const CONTROLS = "button, select, summary, nav a, a.button, textarea, input:not([type=radio], [type=checkbox]), label.choice, label.check";

export const checksOf = (page) => ({
  /** Counts what axe-core finds on the page. */
  async audit() {
    if (!(await page.evaluate(() => "axe" in window))) await page.addScriptTag({ path: AXE });
    const { violations } = await page.evaluate(() => window.axe.run(document, { iframes: false }));
    return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target).join(", ")}`);
  },

  /** Lists visible controls that are lower than a gloved thumb needs. */
  findSmall: () => page.evaluate((controls) => [...document.querySelectorAll(controls)]
    .filter((one) => one.checkVisibility() && one.getBoundingClientRect().height < 44)
    .map((one) => one.id || one.innerText), CONTROLS),

  /** Width [px] by which the page is wider than the screen. */
  findOverflow: () => page.evaluate(() => document.documentElement.scrollWidth - innerWidth),
});

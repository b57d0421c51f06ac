// Checks of a page as it is: axe-core, height of controls, sideways scrolling; and all of them at several sizes.

import { createRequire } from "node:module";

const AXE = createRequire(import.meta.url).resolve("axe-core/axe.min.js");
const COLOUR_RULES = ["color-contrast", "link-in-text-block"];
const WIDTHS = [1400, 820, 390];
const CONTROLS = "button, select, textarea, summary, nav a, a.button, a.link, tbody a, .compared a, "
  + "input:not([type=radio], [type=checkbox]), label.choice, label.check";

/** Returns the checks of a page. */
export function makeChecks(page) {
  /** Lists what axe-core finds, by all its rules or by some. */
  async function audit(rules = undefined) {
    if (!(await page.evaluate(() => "axe" in window))) await page.addScriptTag({ path: AXE });
    // Without the names of all elements that pass, an audit takes half the time.
    const options = { iframes: false, resultTypes: ["violations"], ...(rules && { runOnly: { type: "rule", values: rules } }) };
    const { violations } = await page.evaluate((given) => window.axe.run(document, given), options);
    return violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target).join(", ")}`);
  }

  /** Lists what depends on colours, for a view that was audited in the other scheme. */
  const auditColours = () => audit(COLOUR_RULES);

  /** Lists visible controls that are lower than a gloved thumb needs. */
  const findSmall = () => page.evaluate((controls) => [...document.querySelectorAll(controls)]
    .filter((one) => one.checkVisibility() && one.getBoundingClientRect().height < 44)
    .map((one) => one.id || one.innerText || one.name), CONTROLS);

  /** Returns by how many pixels the page is wider than its window. */
  const findOverflow = () => page.evaluate(() => document.documentElement.scrollWidth - innerWidth);

  /** Returns all findings on a view, each with the width or the scheme at which it shows. */
  async function inspect(widths = WIDTHS) {
    const found = [];
    for (const width of widths) {
      await page.setViewportSize({ width, height: 1180 });
      const overflow = await findOverflow();
      if (overflow > 0) found.push(`${width}: ${overflow} px too wide`);
      for (const one of [...(await audit()), ...(await findSmall()).map((name) => `too low: ${name}`)]) found.push(`${width}: ${one}`);
    }
    await page.setViewportSize({ width: widths[0], height: 900 });
    await page.emulateMedia({ colorScheme: "dark" });
    for (const one of await auditColours()) found.push(`dark: ${one}`); // the scheme changes colours alone
    await page.emulateMedia({ colorScheme: "light" });
    return found;
  }

  return { audit, auditColours, findSmall, findOverflow, inspect };
}

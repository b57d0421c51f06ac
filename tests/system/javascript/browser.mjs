// Headless chromium with one page, and waits on it.

import { chromium } from "playwright-core";

/** Opens a page with a size, a colour scheme and further arguments of the browser; `close` ends the browser. A script for an audit needs `bypassCSP` on the service itself. */
export async function openPage(executablePath, { width = 1280, height = 800, colorScheme = "light", bypassCSP = false, args = [] } = {}) {
  // Tests run as root in containers, where chromium's own sandbox cannot be set up; only our own page is opened.
  const browser = await chromium.launch({ executablePath, args: ["--no-sandbox", ...args] });
  const context = await browser.newContext({ viewport: { width, height }, colorScheme, bypassCSP, reducedMotion: "reduce" });
  const page = await context.newPage();
  page.setDefaultTimeout(Number(process.env.PAGE_TIMEOUT_MS ?? 20_000)); // longer on a machine that is busy
  return { page, close: () => browser.close() };
}

/** Returns waits on a page: for a function that becomes true in it, and for words in an element. */
export function makeWaits(page) {
  const until = (check, argument, timeout) => page.waitForFunction(check, argument, timeout && { timeout });
  const hasText = (selector, words, timeout) =>
    until(([at, what]) => document.querySelector(at)?.innerText.includes(what), [selector, words], timeout);
  return { until, hasText };
}

// Measures the Bench view for some seconds and prints the figures as JSON:
//   node measure_page.mjs ADDRESS CHROMIUM SECONDS [STATE]
// It prints `ready` once the page shows the bench at rest, and measures once it shows STATE, by default a run.
// A frame counts as drawn if it clears a canvas. The age of the newest sample in view is the one that the page states.

import { openPage } from "../../tests/system/javascript/browser.mjs";

const [address, chromium, seconds, state = "Running"] = process.argv.slice(2);
const { page, close } = await openPage(chromium, { height: 1100 });

/** Counts the frames of the browser and those that drew, and collects the stated ages [ms]. */
function measure(duration) {
  const counts = { frames: 0, drawn: 0, ages: [] };
  let hasDrawn = false;
  const clear = CanvasRenderingContext2D.prototype.clearRect;
  CanvasRenderingContext2D.prototype.clearRect = function (...box) {
    hasDrawn = true;
    return clear.apply(this, box);
  };
  const began = performance.now();
  const observer = new MutationObserver(() => {
    const found = /is (\d+) ms old/.exec(document.getElementById("live-age").textContent);
    counts.ages.push(found ? Number(found[1]) : Infinity);
  });
  observer.observe(document.getElementById("live-age"), { childList: true, characterData: true, subtree: true });
  return new Promise((resolve) => {
    function onFrame() {
      counts.frames++;
      if (hasDrawn) counts.drawn++;
      hasDrawn = false;
      const elapsed = performance.now() - began;
      if (elapsed < duration) return requestAnimationFrame(onFrame);
      observer.disconnect();
      resolve({ ...counts, seconds: elapsed / 1000 });
    }
    requestAnimationFrame(onFrame);
  });
}

try {
  const shows = (word) => page.waitForFunction((it) => document.getElementById("state-word").innerText === it, word, { timeout: 60_000 });
  await page.goto(address);
  await shows("Idle");
  console.log("ready");
  await shows(state);
  console.log(JSON.stringify(await page.evaluate(measure, 1000 * Number(seconds))));
} finally {
  await close();
}

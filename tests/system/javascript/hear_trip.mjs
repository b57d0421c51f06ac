// Notes whether the page says that a trip cannot be heard, and the tones of a trip, and prints them as JSON:
//   node hear_trip.mjs URL TOKEN CHROMIUM

import { makeWaits, openPage } from "./browser.mjs";

const [url, token, chromium] = process.argv.slice(2);
const { page, close } = await openPage(chromium, { args: ["--autoplay-policy=document-user-activation-required"] });
const { until, hasText } = makeWaits(page);
const seen = { errors: [] };
page.on("pageerror", (error) => seen.errors.push(String(error)));

/** Counts the tones that are started. A script that looks at the page counts as a person, so the browser's rule is repeated here. */
await page.addInitScript(() => {
  let isTouched = false;
  for (const kind of ["mousedown", "keydown"]) addEventListener(kind, () => (isTouched = true), { capture: true });
  const resume = AudioContext.prototype.resume;
  AudioContext.prototype.resume = function permit() {
    return isTouched ? resume.call(this) : Promise.reject(new DOMException("nobody has touched the page", "NotAllowedError"));
  };
  window.tones = 0;
  const start = OscillatorNode.prototype.start;
  OscillatorNode.prototype.start = function count(...times) {
    window.tones++;
    return start.apply(this, times);
  };
});
const post = (path) => fetch(`${url}/api/v1/${path}`, { method: "POST", headers: { Authorization: `Bearer ${token}` } });
const look = () => page.evaluate(() => ({
  notes: [...document.querySelectorAll(".sound-off")].map((one) => one.innerText),
  tones: window.tones,
}));

try {
  await page.goto(`${url}/#token=${token}`);
  await hasText("#state-word", "Idle");
  seen.untouched = await look();
  await post("bench/stop"); // the fake bench trips
  await hasText("#state-word", "Tripped");
  await page.waitForTimeout(2_000); // longer than the pause between two tones
  seen.tripped = await look();
  await page.keyboard.press("Shift");
  await until(() => window.tones > 0);
  await until(() => document.querySelector(".sound-off.absent"));
  seen.touched = await look();
  await page.click("#silence");
  const { tones } = await look();
  await page.waitForTimeout(2_000);
  seen.silenced = (await look()).tones - tones;
  await page.reload();
  await hasText("#state-word", "Tripped");
  seen.reloaded = await look();
  await page.mouse.click(5, 5);
  await until(() => window.tones > 0);
  seen.clicked = await look();
  console.log(JSON.stringify(seen));
} finally {
  await close();
}

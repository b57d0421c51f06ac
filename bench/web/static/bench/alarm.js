// Trip of the bench, large and audible: a banner in every view, and two tones until they are silenced or the trip ends.

import { byId, write } from "../common/format.js";

const TONES_HZ = [880, 660];
const TONE_S = 0.25;
const REPEAT_MS = 1_500;

export class TripAlarm {
  constructor() {
    this.reason = "";
    this.sound = null;
    byId("silence").addEventListener("click", () => this.silence());
    // Browsers allow sound only after a person has operated the page.
    for (const kind of ["pointerdown", "keydown"]) addEventListener(kind, () => this.unlock(), { capture: true });
  }

  /** Shows the reason of a trip; an empty one ends the alarm. */
  show(reason) {
    if (reason === this.reason) return;
    this.reason = reason;
    byId("trip").hidden = !reason;
    write(byId("trip-reason"), reason);
    this.silence();
    if (!reason) return;
    byId("silence").hidden = false;
    this.timer = setInterval(() => this.sing(), REPEAT_MS);
    this.sing();
  }

  silence() {
    clearInterval(this.timer);
    byId("silence").hidden = true;
  }

  unlock() {
    this.sound ??= new AudioContext();
    if (this.sound.state === "suspended") this.sound.resume().catch(() => {});
  }

  sing() {
    const { sound } = this;
    if (sound?.state !== "running") return;
    TONES_HZ.forEach((frequency, k) => {
      const tone = new OscillatorNode(sound, { type: "square", frequency });
      tone.connect(new GainNode(sound, { gain: 0.2 })).connect(sound.destination);
      tone.start(sound.currentTime + k * TONE_S);
      tone.stop(sound.currentTime + (k + 1) * TONE_S);
    });
  }
}

// Trip of the bench, large and audible: a banner in every view, and two tones until they are silenced or the trip ends.

import { byId, write } from "../common/format.js";

const TONES_HZ = [880, 660];
const TONE_S = 0.25;
const REPEAT_MS = 1_500;
/** Events after which a browser may permit sound; a finger counts when it is lifted, a mouse when it is pressed. */
const OPERATIONS = ["pointerdown", "pointerup", "keydown"];

export class TripAlarm {
  constructor() {
    this.reason = "";
    this.sound = null;
    byId("silence").addEventListener("click", () => this.silence());
    // Browsers allow sound only after a person has operated the page, and a reload ends the permission.
    for (const kind of OPERATIONS) addEventListener(kind, () => this.unlock(), { capture: true });
    this.unlock();
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

  /** Opens the sound, which stays blocked until the browser permits it; a sound that is on stays as it is. */
  unlock() {
    this.sound ??= this.open();
    if (this.sound && this.sound.state !== "running") this.sound.resume().catch(() => {}); // the page says that it is off
    this.showSound();
  }

  /** Returns a sound whose changes are shown; null on a device that has none at present. */
  open() {
    try {
      const sound = new AudioContext();
      sound.addEventListener("statechange", () => this.showSound());
      return sound;
    } catch {
      return null;
    }
  }

  /** Shows whether a trip could be heard. */
  showSound() {
    const isOn = this.sound?.state === "running";
    for (const note of document.querySelectorAll(".sound-off")) note.classList.toggle("absent", isOn);
  }

  sing() {
    this.unlock();
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

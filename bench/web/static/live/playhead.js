// Time up to which live samples are shown, so that they move evenly although they arrive in batches.

/** Largest delay [s]: a longer pause of the samples is shown as one. */
const MAX_DELAY = 0.15;
/** Share by which a delay that is no longer needed shrinks with each batch. */
const SHRINK = 0.05;

/** Smallest delay behind the present at which every frame finds new samples. */
export class Playhead {
  /** `clock` is the clock of the service. */
  constructor(clock) {
    this.clock = clock;
    this.delay = 0;
  }

  /** Takes the stamp [s] of the newest sample at hand, immediately before later ones are added. */
  observe(utc) {
    const needed = Math.min(this.clock.age(utc), MAX_DELAY);
    this.delay = needed > this.delay ? needed : this.delay + SHRINK * (needed - this.delay);
  }

  /** UTC [s] up to which samples are shown at present. */
  get utc() {
    return this.clock.present - this.delay;
  }
}

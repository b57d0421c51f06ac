// Remaining time that is shown each second, counted from the moment that the service told it.

const PERIOD_MS = 250;

export class Countdown {
  /** `onTick` receives the remaining time [s]; `onEnd` is called once when none is left. */
  constructor({ onTick, onEnd }) {
    Object.assign(this, { onTick, onEnd, timer: null });
  }

  get isRunning() {
    return this.timer !== null;
  }

  /** Begins to count a time [s] down. */
  begin(seconds) {
    this.end();
    this.until = performance.now() + 1000 * seconds;
    this.timer = setInterval(() => this.tick(), PERIOD_MS);
    this.tick();
  }

  tick() {
    const left = Math.ceil((this.until - performance.now()) / 1000);
    if (left > 0) return this.onTick(left);
    this.end();
    this.onEnd();
  }

  /** Ends the counting without a call. */
  end() {
    clearInterval(this.timer);
    this.timer = null;
  }
}

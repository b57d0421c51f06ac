// UTC of the service, independent of the clock of this device.

/**
 * Estimate of the present UTC from the stamps of messages. A stamp was never made after its arrival, so each is a lower
 * bound of the present, and the largest bound comes from the message with the shortest way. A clock of the service that
 * is set back makes everything look older: the bench then counts as silent, never as alive.
 */
export class ServiceClock {
  /** `now` returns the monotonic time [s]. */
  constructor(now = () => performance.now() / 1000) {
    this.now = now;
    this.offset = -Infinity;
  }

  /** Takes a stamp [s since 1970] that has just arrived. */
  update(utc) {
    this.offset = Math.max(this.offset, utc - this.now());
  }

  /** Present UTC [s]; minus infinity before the first stamp has arrived. */
  get present() {
    return this.offset + this.now();
  }

  /** Time [s] since a stamp; infinite before the first stamp has arrived. */
  age(utc) {
    return Number.isFinite(this.offset) ? Math.max(0, this.now() + this.offset - utc) : Infinity;
  }
}

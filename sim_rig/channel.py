"""How one channel turns the truth into what it reports, block by block.

A reading passes, in this order: the device's anti-alias filter (run on the finely kept truth, so that it is
right), transport delay and the error of the device's clock, gain, zero and drift, noise, saturation, and the
steps of the converter. Readings are stamped on the bench clock as mapped; what the mapping leaves (an offset drawn
for each run, a slow wander, jitter of each stamp) is a difference between the true and the claimed delay.

A channel carries the state of its filter and of its chances on from block to block, so the readings do not depend
on how the truth is cut. A whole record is one block.
"""

import math
from typing import NamedTuple

import numba
import numpy as np
import numpy.typing as npt
from scipy import signal

from sim_rig.compiled import Array, compiled
from sim_rig.settings import Clock, Filter, Sensor

_WANDER_PERIOD = 100.0
"""[s] of the slow drift that the mapping of a clock leaves."""
_NO_LAG = 8e-5
"""[s] a hidden lag below which there is none: faster than any filter that a device can have."""
_LARGEST_JITTER = 9.0
"""Standard deviations by which no stamp is ever off."""
_BEYOND = 3
"""Samples of the truth behind an instant that the cubic through it takes, the instant's own included."""


class Drawn(NamedTuple):
    """What chance gives one channel for one run: hidden from every log."""

    zero: float
    """[channel unit] zero shift, the set one included."""
    offset: float
    """[s] that the mapping of its clock leaves: the truth reported at t is that of t - delay + offset."""
    wander: float
    """[s] amplitude of its slow drift."""
    phase: float
    """[rad] of that drift at the start."""


def drawn_for(sensor: Sensor, clock: Clock, random: np.random.Generator) -> Drawn:
    """Draw the zero shift and clock error of one channel for one run."""
    zero = sensor.zero + sensor.zero_spread * random.standard_normal()
    offset = clock.mapping_error * random.standard_normal()
    return Drawn(zero, offset, clock.wander * math.sqrt(2), random.uniform(0, 2 * math.pi))


class View(NamedTuple):
    """How a channel looks at the truth."""

    dt: float
    """[s] between two values of the truth."""
    held: bool = False
    """Whether each value stands until the next, as the output of the amplifier does."""
    lag: float = 0.0
    """[s] by which the channel comes later than it claims."""
    slow: float = 0.0
    """[s] time constant of a lag of which it says nothing."""


class ChannelStream:
    """One channel for one run: truth in, readings out."""

    def __init__(self, view: View, rate: float, sensor: Sensor, drawn: Drawn, random: np.random.Generator) -> None:
        """Begin at time 0.

        Args:
            view: how it looks at the truth.
            rate: [Hz] readings a second.
            sensor: its settings.
            drawn: what chance gave it for this run.
            random: parent of its own chances.
        """
        self.rate = rate
        """[Hz] readings a second."""
        self._view, self._sensor, self._drawn = view, sensor, drawn
        # A stream of chances each: how many readings are made at a time must not change who gets which.
        self._jitter, self._white, self._shocks = random.spawn(3)
        hidden = [Filter(order=1, cutoff=1 / (2 * math.pi * view.slow))] if view.slow > _NO_LAG else []
        device = [sensor.filter] if sensor.filter else []
        self._filters = [FilterStream(low_pass, view.dt) for low_pass in hidden + device]
        self._truth = np.empty(0)
        self._first = 0
        self._next = 0
        self._kept = math.exp(-1 / (rate * sensor.slow_noise_time))
        self._slow = np.zeros(1)

    def take(self, truth: Array) -> None:
        """The truth goes on, (K,) values in the channel's unit."""
        for low_pass in self._filters:
            truth = low_pass.take(truth)
        self._truth = np.concatenate([self._truth, truth])

    def ready(self) -> int:
        """How many readings the truth so far allows beside those already made."""
        known = self._first + len(self._truth)
        last = known - 1 if self._view.held else known - _BEYOND
        if known <= _BEYOND:
            return 0
        ahead = self._sensor.delay + self._view.lag - self._drawn.offset
        # By as much as clock and stamp can ever be ahead: no reading looks at truth that has not come.
        ahead -= self._drawn.wander + _LARGEST_JITTER * self._sensor.jitter
        # A reading that is due at this very instant is not put off by rounding.
        return max(math.floor((last * self._view.dt + ahead) * self.rate + 1e-6) + 1 - self._next, 0)

    def make(self, count: int) -> tuple[Array, Array]:
        """The next readings.

        Args:
            count: how many; beyond those that are ready, the truth is taken to stand still.

        Returns:
            (count,) stamps since the start [s] and (count,) readings in the channel's unit.
        """
        stamps = np.arange(self._next, self._next + count) / self.rate
        instants = self._instants(stamps)
        look = held_at if self._view.held else at_instants
        true = look(self._truth, self._view.dt, instants, self._first)
        value = true * (1 + self._sensor.gain_error) + self._drawn.zero + self._sensor.drift * stamps
        value = _converted(value + self._noise(count), self._sensor)
        self._next += count
        self._forget()
        return stamps, value

    def _instants(self, stamps: Array) -> Array:
        """When each reading sees the truth [s]."""
        drawn, sensor = self._drawn, self._sensor
        instants = stamps - sensor.delay - self._view.lag + drawn.offset
        if drawn.wander:
            instants += drawn.wander * np.sin(2 * np.pi * stamps / _WANDER_PERIOD + drawn.phase)
        if sensor.jitter:
            jitter = self._jitter.standard_normal(len(stamps))
            instants += sensor.jitter * np.minimum(np.maximum(jitter, -_LARGEST_JITTER), _LARGEST_JITTER)
        return instants

    def _noise(self, count: int) -> Array:
        """White and coloured noise, one value a reading."""
        sensor = self._sensor
        noise = sensor.noise * self._white.standard_normal(count) if sensor.noise else np.zeros(count)
        if sensor.slow_noise and count:
            shocks = sensor.slow_noise * self._shocks.standard_normal(count)
            # All but the very first: the noise has its full size from the beginning.
            shocks[1 if self._next == 0 else 0 :] *= math.sqrt(1 - self._kept**2)
            coloured, self._slow = signal.lfilter([1.0], [1.0, -self._kept], shocks, zi=self._slow)
            noise += coloured
        return noise

    def _forget(self) -> None:
        """Let go of the truth that no further reading looks at."""
        drawn, sensor = self._drawn, self._sensor
        late = sensor.delay + self._view.lag - drawn.offset + drawn.wander + _LARGEST_JITTER * sensor.jitter
        needed = math.floor((self._next / self.rate - late) / self._view.dt) - _BEYOND
        known = self._first + len(self._truth)
        first = max(min(needed, known - _BEYOND - 1), self._first)
        self._truth, self._first = self._truth[first - self._first :], first


class FilterStream:
    """An analogue filter that is settled at its first value.

    It is stepped exactly for a signal that goes straight from sample to sample.
    """

    def __init__(self, filter_: Filter, dt: float) -> None:
        """Begin.

        Args:
            filter_: which.
            dt: [s] between the samples of its signal.
        """
        analogue = signal.butter(filter_.order, 2 * math.pi * filter_.cutoff, analog=True)
        numerator, denominator, _ = signal.cont2discrete(analogue, dt, method="foh")
        self._b, self._a = np.ravel(numerator), np.ravel(denominator)
        self._state: Array | None = None

    def take(self, values: Array) -> Array:
        """What leaves the filter while ``values`` enter it."""
        if not len(values):
            return values
        if self._state is None:
            self._state = signal.lfilter_zi(self._b, self._a) * values[0]
        passed, self._state = signal.lfilter(self._b, self._a, values, zi=self._state)
        return np.asarray(passed)


def at_instants(values: Array, dt: float, instants: Array, first: int = 0) -> Array:
    """A signal at any instants [s], by cubics through four samples.

    Args:
        values: sampled every dt [s]; at least four.
        dt: [s]
        instants: since time 0 [s]; beyond the signal it stands still.
        first: number of the first of the values, 0 being at time 0.
    """
    return _cubic(np.ascontiguousarray(values), dt, np.ascontiguousarray(instants), first)


def _by_cubics(values: Array, dt: float, instants: Array, first: int) -> Array:
    found = np.empty(len(instants))
    for j in range(len(instants)):
        place = min(max(instants[j] / dt, 0.0), first + len(values) - 1.0)
        i = min(max(math.floor(place), first + 1), first + len(values) - 3)
        t, here = place - i, i - first
        found[j] = (
            values[here] * (1 + t) * (1 - t) * (2 - t) / 2
            + values[here + 1] * t * (1 + t) * (2 - t) / 2
            - values[here - 1] * t * (1 - t) * (2 - t) / 6
            - values[here + 2] * t * (1 + t) * (1 - t) / 6
        )
    return found


_ROW = numba.float64[::1]
_cubic = compiled(_by_cubics, _ROW(_ROW, numba.float64, _ROW, numba.int64))


def held_at(values: Array, dt: float, instants: Array, first: int = 0) -> Array:
    """A signal that stands for dt [s] from each sample on, read half way through; as `at_instants`."""
    places: npt.NDArray[np.int64] = np.rint(instants / dt).astype(np.int64) - first
    return np.asarray(values[np.clip(places, 0, len(values) - 1)])


def _converted(value: Array, sensor: Sensor) -> Array:
    """Saturated at the limit and rounded to the converter's steps."""
    if sensor.limit is not None:
        value = np.minimum(np.maximum(value, -sensor.limit), sensor.limit)
    return np.round(value / sensor.resolution) * sensor.resolution if sensor.resolution else value

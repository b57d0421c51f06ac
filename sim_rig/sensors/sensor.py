"""Sensor model of one channel: true values in, readings out, chunk by chunk.

A true value first passes the device's anti-alias filter, at the resolution of the plant's substeps. Then follow
transport delay and clock error, gain, zero and drift, noise, saturation, and the steps of the converter. Readings
are stamped on the bench clock as mapped. The error of the mapping is an offset drawn for each run, a slow drift,
and jitter of each stamp. It is the difference between true and reported delay.

A channel keeps the states of its filter and of its random numbers from chunk to chunk. Its readings therefore do
not depend on how the true values are divided into chunks.
"""

import math
from typing import NamedTuple

import numpy as np

from sim_rig.plant import Array
from sim_rig.scenario import ClockDeviation, Filter, Sensor
from sim_rig.sensors.readings import ReadingConstants, convert_readings
from sim_rig.sensors.sampling import FilterStream, ResponseStream, apply_filter

_MIN_LAG = 8e-5
"""Threshold on a hidden lag [s]: below it, the lag is omitted, as it is faster than any filter of a device."""
_MAX_JITTER = 9.0
"""Limit on the jitter of a stamp, in standard deviations [1]."""
_LOOKAHEAD_SAMPLES = 3
"""True values after an instant that its cubic interpolation needs, that of the instant included."""


class ChannelErrors(NamedTuple):
    """Errors drawn for one channel and one run; no log contains them."""

    zero: float
    """[channel unit] zero shift, including the one set in the scenario."""
    offset: float
    """[s] error of the clock mapping: the reading at t shows the true value at t - delay + offset."""
    drift: float
    """[s] amplitude of the slow drift of the clock mapping."""
    phase: float
    """[rad] phase of that drift at the start."""


def sample_channel_errors(sensor: Sensor, clock: ClockDeviation, random: np.random.Generator) -> ChannelErrors:
    """Draw the zero shift and clock error of one channel for one run."""
    zero = sensor.zero + sensor.zero_spread * random.standard_normal()
    offset = clock.mapping_error * random.standard_normal()
    return ChannelErrors(zero, offset, clock.drift * math.sqrt(2), random.uniform(0, 2 * math.pi))


class SamplingModel(NamedTuple):
    """Sampling of the true values by a channel."""

    dt: float
    """[s] between two true values."""
    held: bool = False
    """True if each value is held until the next, as the output of the amplifier is."""
    hidden_delay: float = 0.0
    """[s] delay beyond the one that the channel reports."""
    hidden_lag: float = 0.0
    """[s] time constant of a lag that the channel does not report."""
    responses: tuple[Array, ...] = ()
    """Weights of the last true values [1], the newest first, in each step response that it does not report."""


class ChannelStream:
    """One channel for one run: true values in, readings out."""

    def __init__(
        self, model: SamplingModel, rate: float, sensor: Sensor, errors: ChannelErrors, random: np.random.Generator
    ) -> None:
        """Start at time 0.

        Args:
            model: sampling of the true values.
            rate: [Hz] readings per second.
            sensor: errors and settings of the channel.
            errors: drawn for this run.
            random: parent of the channel's random generators.
        """
        self.rate = rate
        """[Hz] readings per second."""
        self._model, self._sensor, self._errors = model, sensor, errors
        # One generator per kind of error, so that the numbers do not depend on how many readings are made at once.
        self._jitter, self._white, self._shocks = random.spawn(3)
        hidden = (
            [Filter(order=1, cutoff=1 / (2 * math.pi * model.hidden_lag))] if model.hidden_lag > _MIN_LAG else []
        )
        device = [sensor.filter] if sensor.filter else []
        responses = [ResponseStream(weights) for weights in model.responses]
        self._filters: list[ResponseStream | FilterStream] = [
            *responses,
            *(FilterStream(low_pass, model.dt) for low_pass in hidden + device),
        ]
        self._true_values = np.empty(0)
        self._first = 0
        self._next = 0
        self._correlation = math.exp(-1 / (rate * sensor.slow_noise_time))
        self._noise_filter = np.array([1.0, 0.0]), np.array([1.0, -self._correlation])
        self._noise_state = np.zeros(1)
        self._constants = _make_constants(model, sensor, errors)

    def feed(self, true_values: Array) -> None:
        """Add (K,) further true values in the channel's unit."""
        for filter_ in self._filters:
            true_values = filter_.feed(true_values)
        self._true_values = np.concatenate([self._true_values, true_values])

    def count_ready(self) -> int:
        """Return the number of further readings that the true values allow so far."""
        known = self._first + len(self._true_values)
        last = known - 1 if self._model.held else known - _LOOKAHEAD_SAMPLES
        if known <= _LOOKAHEAD_SAMPLES:
            return 0
        ahead = self._sensor.delay + self._model.hidden_delay - self._errors.offset
        # Less the largest drift and jitter, so that no reading needs true values that are still missing.
        ahead -= self._errors.drift + _MAX_JITTER * self._sensor.jitter
        # The tolerance keeps rounding from postponing a reading that is due exactly now.
        return max(math.floor((last * self._model.dt + ahead) * self.rate + 1e-6) + 1 - self._next, 0)

    def make_readings(self, count: int) -> tuple[Array, Array]:
        """Return the next readings.

        Args:
            count: number of readings; beyond those that are ready, the true value is taken as constant.

        Returns:
            (count,) stamps since the start [s] and (count,) readings in the channel's unit.
        """
        stamps, values = np.empty(count), np.empty(count)
        convert_readings(
            self._true_values, self._first, self._model.dt, self._model.held, self._next, self.rate,
            self._constants, self._draw_jitter(count), self._draw_noise(count), stamps, values,
        )  # fmt: skip
        self._next += count
        self._discard_used()
        return stamps, values

    def _draw_jitter(self, count: int) -> Array:
        """Return the random error [s] of the instant of each reading."""
        if not self._sensor.jitter:
            return np.zeros(count)
        jitter = self._jitter.standard_normal(count)
        return np.asarray(self._sensor.jitter * np.minimum(np.maximum(jitter, -_MAX_JITTER), _MAX_JITTER))

    def _draw_noise(self, count: int) -> Array:
        """Return white plus coloured noise for each reading."""
        sensor = self._sensor
        noise = sensor.noise * self._white.standard_normal(count) if sensor.noise else np.zeros(count)
        if sensor.slow_noise and count:
            shocks = sensor.slow_noise * self._shocks.standard_normal(count)
            # All but the first shock of the run, so that the noise has its full size from the start.
            shocks[1 if self._next == 0 else 0 :] *= math.sqrt(1 - self._correlation**2)
            noise += apply_filter(*self._noise_filter, shocks, self._noise_state)
        return noise

    def _discard_used(self) -> None:
        """Discard the true values that no further reading needs."""
        errors, sensor = self._errors, self._sensor
        delay = (
            sensor.delay + self._model.hidden_delay - errors.offset + errors.drift + _MAX_JITTER * sensor.jitter
        )
        needed = math.floor((self._next / self.rate - delay) / self._model.dt) - _LOOKAHEAD_SAMPLES
        known = self._first + len(self._true_values)
        first = max(min(needed, known - _LOOKAHEAD_SAMPLES - 1), self._first)
        self._true_values, self._first = self._true_values[first - self._first :], first


def _make_constants(model: SamplingModel, sensor: Sensor, errors: ChannelErrors) -> ReadingConstants:
    return ReadingConstants(
        delay=float(sensor.delay),
        hidden_delay=float(model.hidden_delay),
        offset=float(errors.offset),
        drift=float(errors.drift),
        phase=float(errors.phase),
        gain=1.0 + sensor.gain_error,
        zero=float(errors.zero),
        zero_drift=float(sensor.drift),
        limit=math.inf if sensor.limit is None else float(sensor.limit),
        resolution=float(sensor.resolution),
    )

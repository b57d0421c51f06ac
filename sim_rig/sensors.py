"""True to reported: what each channel makes of the truth.

A reading passes, in this order: the device's anti-alias filter (run on the finely kept truth, so that it is
right), transport delay and the error of the device's clock, gain, zero and drift, noise, saturation, and the
steps of the converter. Readings are stamped on the bench clock as mapped; what the mapping leaves (an offset drawn
for each run, a slow wander, jitter of each stamp) is a difference between the true and the claimed delay.

The amplifier's channels are read half way through each update, when the output stands, and are stamped with its
start: the drive at a sample is the one held until the next.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy import signal

from sim_rig.compiled import Array
from sim_rig.plant import Effects, Truth, blocks_in
from sim_rig.scenario import Scenario
from sim_rig.settings import Clock, Filter, Sensor

CHANNELS: dict[str, tuple[str, str]] = {
    "displacement": ("m", "lvdt"),
    "force": ("N", "load_cell"),
    "coil_drive": ("drive", "coil_amplifier"),
    "actuator_position": ("m", "actuator"),
    "coil_current": ("A", "coil_amplifier"),
    "coil_voltage": ("V", "coil_amplifier"),
    "temperature": ("degC", "thermometer"),
}
"""Unit and device of each channel; the unit ``drive`` is V or A."""

_WANDER_PERIOD = 100.0
"""[s] of the slow drift that the mapping of a clock leaves."""


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


class Source(NamedTuple):
    """The truth that a channel looks at, from the start of the run on."""

    values: Array
    """(K,) in the channel's unit."""
    dt: float
    """[s] between them."""
    held: bool = False
    """Whether each value stands until the next, as the output of the amplifier does."""
    lag: float = 0.0
    """[s] by which the channel comes later than it claims."""


def readings(source: Source, time: Array, sensor: Sensor, drawn: Drawn, random: np.random.Generator) -> Array:
    """What a channel reports.

    Args:
        source: the truth.
        time: (N,) on the bench clock, from 0 [s].
        sensor: its settings.
        drawn: what chance gave it for this run.
        random: for noise and jitter.

    Returns:
        (N,) readings in the channel's unit.
    """
    rate = sensor.rate or 1 / (time[1] - time[0])
    ticks = np.floor(time * rate + 1e-6).astype(np.int64)
    stamps = np.arange(ticks[-1] + 1) / rate
    wander = drawn.wander * np.sin(2 * np.pi * stamps / _WANDER_PERIOD + drawn.phase)
    jitter = sensor.jitter * random.standard_normal(len(stamps))
    instants = stamps - sensor.delay - source.lag + drawn.offset + wander + jitter
    smooth = filtered(source.values, source.dt, sensor.filter)
    true = held_at(smooth, source.dt, instants) if source.held else at_instants(smooth, source.dt, instants)
    value = true * (1 + sensor.gain_error) + drawn.zero + sensor.drift * stamps
    return _converted(value + _noise(sensor, stamps, random), sensor)[ticks]


def filtered(values: Array, dt: float, filter_: Filter | None) -> Array:
    """A signal sampled every dt [s] behind an analogue filter that is settled at its first value.

    The filter is stepped exactly for a signal that goes straight from sample to sample.
    """
    if filter_ is None:
        return values
    analogue = signal.butter(filter_.order, 2 * math.pi * filter_.cutoff, analog=True)
    numerator, denominator, _ = signal.cont2discrete(analogue, dt, method="foh")
    b, a = np.ravel(numerator), np.ravel(denominator)
    settled = signal.lfilter_zi(b, a) * values[0]
    return np.asarray(signal.lfilter(b, a, values, zi=settled)[0])


def at_instants(values: Array, dt: float, instants: Array) -> Array:
    """A signal sampled every dt [s] from zero on, at any instants [s], by cubics through four samples."""
    place = np.clip(instants / dt, 0.0, len(values) - 1.0)
    i = np.clip(np.floor(place).astype(np.int64), 1, len(values) - 3)
    t = place - i
    before, here, after, beyond = (values[i + shift] for shift in (-1, 0, 1, 2))
    return np.asarray(
        here * (1 + t) * (1 - t) * (2 - t) / 2
        + after * t * (1 + t) * (2 - t) / 2
        - before * t * (1 - t) * (2 - t) / 6
        - beyond * t * (1 + t) * (1 - t) / 6
    )


def held_at(values: Array, dt: float, instants: Array) -> Array:
    """A signal that stands for dt [s] from each sample on, read half way through, at any instants [s]."""
    return np.asarray(values[np.clip(np.rint(instants / dt).astype(np.int64), 0, len(values) - 1)])


def _noise(sensor: Sensor, stamps: Array, random: np.random.Generator) -> Array:
    """White and coloured noise, one value a stamp."""
    noise = sensor.noise * random.standard_normal(len(stamps))
    if sensor.slow_noise == 0 or len(stamps) < 2:
        return noise
    kept = math.exp(-(stamps[1] - stamps[0]) / sensor.slow_noise_time)
    shocks = sensor.slow_noise * random.standard_normal(len(stamps))
    shocks[1:] *= math.sqrt(1 - kept * kept)
    return noise + np.asarray(signal.lfilter([1.0], [1.0, -kept], shocks))


def _converted(value: Array, sensor: Sensor) -> Array:
    """Saturated at the limit and rounded to the converter's steps."""
    if sensor.limit is not None:
        value = np.clip(value, -sensor.limit, sensor.limit)
    return np.round(value / sensor.resolution) * sensor.resolution if sensor.resolution else value


def report(scenario: Scenario, time: Array, truth: Truth) -> tuple[dict[str, Array], dict[str, Drawn]]:
    """All channels of a run, and what chance gave each.

    Args:
        scenario: sensors, clocks, effects on channels, seed.
        time: (N,) on the bench clock, from 0 [s], N at least 2.
        truth: what happened, N samples.
    """
    step = float(time[-1] - time[0]) / (len(time) - 1)
    values, chances = {}, {}
    for place, (name, source) in enumerate(_sources(scenario, truth, step).items()):
        random = np.random.default_rng([scenario.seed, place])
        sensor: Sensor = getattr(scenario.sensors, name)
        chances[name] = drawn_for(sensor, getattr(scenario.clocks, CHANNELS[name][1]), random)
        values[name] = readings(source, time, sensor, chances[name], random)
    return values, chances


def _sources(scenario: Scenario, truth: Truth, step: float) -> dict[str, Source]:
    """What each channel looks at, in the order of ``CHANNELS``; ``step`` [s] is a sample of the bench."""
    fine, late = step / blocks_in(step), Effects.of(scenario).force_lag
    current, voltage = _coil(scenario, truth.output)
    return {
        "displacement": Source(truth.position, fine),
        "force": Source(truth.force, fine, lag=late),
        "coil_drive": Source(truth.output, step, held=True),
        "actuator_position": Source(truth.position, fine),
        "coil_current": Source(current, step, held=True),
        "coil_voltage": Source(voltage, step, held=True),
        "temperature": Source(truth.temperature, step),
    }


def _coil(scenario: Scenario, drive: Array) -> tuple[Array, Array]:
    """Current [A] and voltage [V] at the coil."""
    resistance = scenario.amplifier.resistance
    return (drive, drive * resistance) if scenario.drive_unit == "A" else (drive / resistance, drive)


def with_faults(scenario: Scenario, time: Array, values: dict[str, Array]) -> dict[str, Array]:
    """The channels with the scenario's faults: a stuck one repeats its last reading, a cut one reads NaN."""
    failed = dict(values)
    for fault in scenario.faults:
        channel = failed[fault.channel].copy()
        away = (time >= fault.start) & (time < fault.start + fault.duration)
        if away.any():
            last = channel[max(int(np.argmax(away)) - 1, 0)]
            channel[away] = last if fault.kind == "stuck" else np.nan
        failed[fault.channel] = channel
    return failed

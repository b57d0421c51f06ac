"""All channels of the rig: what each looks at, and what fails.

How a channel turns that into readings is the affair of `sim_rig.channel`. The amplifier's channels are read half
way through each update, when the output stands, and are stamped with its start: the drive at a sample is the one
held until the next.
"""

from collections.abc import Sequence

import numpy as np

from sim_rig.acting import Effects
from sim_rig.channel import ChannelStream, Drawn, View, drawn_for
from sim_rig.compiled import Array
from sim_rig.plant import Truth, blocks_in
from sim_rig.scenario import Scenario
from sim_rig.sealed_plant import displacement_read
from sim_rig.settings import Fault, Sensor

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


def streams(
    scenario: Scenario, step: float, mapped: bool = True
) -> tuple[dict[str, ChannelStream], dict[str, Drawn]]:
    """Every channel at the start of a run, and what chance gave each.

    Args:
        scenario: sensors, clocks, effects on channels, seed.
        step: [s] a sample of the bench.
        mapped: whether the bench clock is one that the devices' clocks were mapped onto before: then the offset
            that the mapping leaves is part of each reading.
    """
    made, chances = {}, {}
    for place, (name, view) in enumerate(_views(scenario, step).items()):
        # By its place: what a channel draws does not depend on what the others have drawn.
        random = np.random.default_rng([scenario.seed, place])
        sensor: Sensor = getattr(scenario.sensors, name)
        drawn = drawn_for(sensor, getattr(scenario.clocks, CHANNELS[name][1]), random)
        # Over the wires the bench maps the clocks itself: what that leaves is real there, not drawn.
        chances[name] = drawn if mapped else drawn._replace(offset=0.0)
        made[name] = ChannelStream(view, sensor.rate or 1 / step, sensor, chances[name], random)
    return made, chances


def report(scenario: Scenario, time: Array, truth: Truth) -> tuple[dict[str, Array], dict[str, Drawn]]:
    """All channels of a run, and what chance gave each.

    Args:
        scenario: sensors, clocks, effects on channels, seed.
        time: (N,) on the bench clock, from 0 [s], N at least 2.
        truth: what happened, N samples.
    """
    step = float(time[-1] - time[0]) / (len(time) - 1)
    made, chances = streams(scenario, step)
    seen = looked_at(scenario, truth, 0.0, step)
    values = {name: readings(stream, seen[name], time) for name, stream in made.items()}
    return values, chances


def readings(stream: ChannelStream, truth: Array, time: Array) -> Array:
    """What a channel reports over a whole run, held between two readings.

    Args:
        stream: the channel at its start.
        truth: (K,) what it looks at, from time 0 on.
        time: (N,) on the bench clock, from 0 [s].

    Returns:
        (N,) readings in the channel's unit.
    """
    ticks = np.floor(time * stream.rate + 1e-6).astype(np.int64)
    stream.take(truth)
    return stream.make(int(ticks[-1]) + 1)[1][ticks]


def looked_at(scenario: Scenario, truth: Truth, start: float, step: float) -> dict[str, Array]:
    """What each channel looks at, in its unit and in the order of ``CHANNELS``.

    Args:
        scenario: the amplifier, and effects on channels.
        truth: what happened.
        start: [s] its first instant, since the start of the run.
        step: [s] a sample of the bench.
    """
    resistance, drive = scenario.amplifier.resistance, truth.output
    by_current = scenario.drive_unit == "A"
    effects = Effects(scenario)
    return {
        "displacement": _bent(effects, displacement_read(scenario, truth.position)),
        "force": truth.force + _added(effects, truth, start, step),
        "coil_drive": drive,
        "actuator_position": truth.position,
        "coil_current": drive if by_current else drive / resistance,
        "coil_voltage": drive * resistance if by_current else drive,
        "temperature": truth.temperature,
    }


def _bent(effects: Effects, position: Array) -> Array:
    """The actuator's position [m] with what the displacement channel adds to it."""
    bends = effects.that("displacement_map")
    return np.asarray(position + sum(form.act(position, *values) for form, values in bends))


def _added(effects: Effects, truth: Truth, start: float, step: float) -> Array:
    """What the force channel adds [N], at the start of each block."""
    blocks = len(truth.force) // len(truth.output)
    time = start + np.arange(len(truth.force)) * (step / blocks)
    drive = np.repeat(truth.output, blocks)
    added = effects.that("added_force")
    # Zeros where nothing is at work: an empty sum has no shape.
    return np.asarray(0.0 * time + sum(form.act(time, drive, *values) for form, values in added))


def _views(scenario: Scenario, step: float) -> dict[str, View]:
    """How each channel looks at it; ``step`` [s] is a sample of the bench."""
    fine, held, effects = View(step / blocks_in(step)), View(step, held=True), Effects(scenario)
    late, slow = effects.total("time_shift"), effects.total("force_lag")
    return {
        "displacement": fine._replace(lag=effects.total("displacement_shift")),
        "force": fine._replace(lag=late, slow=slow),
        "coil_drive": held,
        "actuator_position": fine,
        "coil_current": held,
        "coil_voltage": held,
        "temperature": View(step),
    }


def with_faults(scenario: Scenario, time: Array, values: dict[str, Array]) -> dict[str, Array]:
    """The channels of a whole run with the scenario's faults."""
    return {
        name: failed(faults_of(scenario, name), time, channel, float(channel[0]))
        for name, channel in values.items()
    }


def faults_of(scenario: Scenario, channel: str) -> list[Fault]:
    """The faults of one channel."""
    return [fault for fault in scenario.faults if fault.channel == channel]


def failed(faults: Sequence[Fault], time: Array, values: Array, before: float) -> Array:
    """The readings of a channel with its faults: stuck, it repeats its last reading; cut, it has none (NaN).

    Args:
        faults: of this channel.
        time: (N,) since the start of the run [s].
        values: (N,) in the channel's unit.
        before: what it reported last.
    """
    for fault in faults:
        away = (time >= fault.start) & (time < fault.start + fault.duration)
        if away.any():
            first = int(np.argmax(away))
            last = values[first - 1] if first else before
            values = np.where(away, last if fault.kind == "stuck" else np.nan, values)
    return values

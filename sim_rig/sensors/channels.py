"""All channels of the rig: their units and devices, their true values, and their readings.

`sim_rig.sensors.sensor` turns true values into readings. The amplifier's channels are read half way through each
update, when the output has settled, and stamped with its start: the drive at a sample is held until the next one.
"""

import numpy as np

from sim_rig.plant import Array, EffectFunctions, TrueSignals, apply_displacement_channel, count_substeps
from sim_rig.scenario import Scenario, Sensor
from sim_rig.sensors.sensor import ChannelErrors, ChannelStream, SamplingModel, sample_channel_errors

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
NO_SHUNT: Array = np.zeros(0)
"""Simulated force of a shunt that is never on."""


def make_streams(
    scenario: Scenario, step: float, mapped: bool = True
) -> tuple[dict[str, ChannelStream], dict[str, ChannelErrors]]:
    """Return every channel at the start of a run, and the errors drawn for each.

    Args:
        scenario: sensors, clocks, effects on channels, seed.
        step: [s] sample period of the bench.
        mapped: whether the devices' clocks were mapped onto the bench clock before. Each reading then has the
            offset that the mapping leaves.
    """
    streams, channel_errors = {}, {}
    for index, (name, model) in enumerate(_make_models(scenario, step).items()):
        # Seeded by its index, so that the numbers drawn for a channel do not depend on the other channels.
        random = np.random.default_rng([scenario.seed, index])
        sensor: Sensor = getattr(scenario.sensors, name)
        errors = sample_channel_errors(sensor, getattr(scenario.clocks, CHANNELS[name][1]), random)
        # Over the wires the bench maps the clocks itself, so the mapping error is real there and not drawn.
        channel_errors[name] = errors if mapped else errors._replace(offset=0.0)
        streams[name] = ChannelStream(model, sensor.rate or 1 / step, sensor, channel_errors[name], random)
    return streams, channel_errors


def make_readings(
    scenario: Scenario, time: Array, truth: TrueSignals, shunt: Array = NO_SHUNT
) -> tuple[dict[str, Array], dict[str, ChannelErrors]]:
    """Return all channels of a run, and the errors drawn for each.

    Args:
        scenario: sensors, clocks, effects on channels, seed.
        time: (N,) on the bench clock, from 0 [s], N at least 2.
        truth: true signals of N samples.
        shunt: (N,) force that the shunt of the load cell simulates [N]; empty for none.
    """
    step = float(time[-1] - time[0]) / (len(time) - 1)
    streams, channel_errors = make_streams(scenario, step)
    true_values = add_shunt(compute_true_values(scenario, truth, 0.0, step), shunt)
    values = {name: read_channel(stream, true_values[name], time) for name, stream in streams.items()}
    return values, channel_errors


def read_channel(stream: ChannelStream, true_values: Array, time: Array) -> Array:
    """Return the readings of a channel over a whole run, held between two readings.

    Args:
        stream: the channel at its start.
        true_values: (K,) from time 0 on, in the channel's unit.
        time: (N,) on the bench clock, from 0 [s].

    Returns:
        (N,) readings in the channel's unit.
    """
    ticks = np.floor(time * stream.rate + 1e-6).astype(np.int64)
    stream.feed(true_values)
    return stream.make_readings(int(ticks[-1]) + 1)[1][ticks]


def compute_true_values(scenario: Scenario, truth: TrueSignals, start: float, step: float) -> dict[str, Array]:
    """Return the true value of each channel in its unit, in the order of ``CHANNELS``.

    Args:
        scenario: the amplifier, and effects on channels.
        truth: true signals.
        start: [s] their first instant, since the start of the run.
        step: [s] sample period of the bench.
    """
    resistance, drive = scenario.amplifier.resistance, truth.output
    current_driven = scenario.drive_unit == "A"
    effects = EffectFunctions(scenario)
    return {
        "displacement": _apply_displacement_effects(effects, scenario, truth, start, step),
        "force": _apply_force_effects(effects, truth, start, step),
        "coil_drive": drive,
        "actuator_position": truth.position,
        "coil_current": drive if current_driven else drive / resistance,
        "coil_voltage": drive * resistance if current_driven else drive,
        "temperature": truth.temperature,
    }


def add_shunt(true_values: dict[str, Array], shunt: Array) -> dict[str, Array]:
    """Return the true values with the force that the shunt simulates in front of the load cell's amplifier.

    Args:
        true_values: of each channel, with several values of the force in each sample.
        shunt: (N,) simulated force of each sample [N]; empty for none.
    """
    if not shunt.any():
        return true_values
    force = true_values["force"]
    return {**true_values, "force": force + np.repeat(shunt, len(force) // len(shunt))}


def _apply_displacement_effects(
    effects: EffectFunctions, scenario: Scenario, truth: TrueSignals, start: float, step: float
) -> Array:
    """Return the actuator's position [m] with the errors that the displacement channel adds."""
    position = apply_displacement_channel(scenario, truth.position)
    maps = effects.select("displacement_map")
    position = position + sum(form.function(position, *values) for form, values in maps)
    for form, values in effects.select("displacement_function"):
        time = _compute_substep_times(truth, start, step)
        true = {"displacement": truth.position, "velocity": truth.velocity, "time": time}
        position = position + form.function(true, *values)
    return np.asarray(position)


def _apply_force_effects(effects: EffectFunctions, truth: TrueSignals, start: float, step: float) -> Array:
    """Return the force on the load cell [N] with the force that its channel adds.

    A defined effect acts on the force after all effects of the library and the defined effects before it.
    """
    added, defined = effects.select("additive_force"), effects.select("channel_function")
    if not added and not defined:
        return truth.force
    time = _compute_substep_times(truth, start, step)
    drive = np.repeat(truth.output, len(truth.force) // len(truth.output))
    force = truth.force + sum(form.function(time, drive, *values) for form, values in added)
    for form, values in defined:
        force = force + form.function({"force": force, "drive": drive, "time": time}, *values)
    return np.asarray(force)


def _compute_substep_times(truth: TrueSignals, start: float, step: float) -> Array:
    """Return the time (K,) [s] of each substep since the start of the run."""
    substeps = len(truth.force) // len(truth.output)
    return np.asarray(start + np.arange(len(truth.force)) * (step / substeps))


def _make_models(scenario: Scenario, step: float) -> dict[str, SamplingModel]:
    """Return the sampling model of each channel; ``step`` [s] is the sample period of the bench."""
    effects = EffectFunctions(scenario)
    fine, held = SamplingModel(step / count_substeps(step)), SamplingModel(step, held=True)
    force_delay, force_lag = effects.sum_values("time_shift"), effects.sum_values("force_lag")
    responses = tuple(effects.compute_response_weights("channel_response", fine.dt))
    return {
        "displacement": fine._replace(hidden_delay=effects.sum_values("displacement_shift")),
        "force": fine._replace(hidden_delay=force_delay, hidden_lag=force_lag, responses=responses),
        "coil_drive": held,
        "actuator_position": fine,
        "coil_current": held,
        "coil_voltage": held,
        "temperature": SamplingModel(step),
    }

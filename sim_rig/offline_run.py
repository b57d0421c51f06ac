"""Offline run: commands from a file, channels to a file, and the hidden truth on request.

The channels file describes the bench (``info``) as its devices would report it: units, rates, reported filters and
delays, mapped clocks. It contains nothing about the damper, the effects or the noise.
"""

import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sim_rig.errors import CommandsError
from sim_rig.plant import Array, TrueSignals, apply_start_ramp, make_plant, split_into_chunks
from sim_rig.scenario import Scenario, Sensor
from sim_rig.sensors import CHANNELS, ChannelErrors, apply_faults, make_readings

_CHUNK_SAMPLES = 10_000
"""Samples between two progress reports."""
_MIN_RATE, _MAX_RATE = 50.0, 20_000.0
"""[Hz] limits of the sampling rate that the rig plays."""


class CommandSeries(NamedTuple):
    """Commands of the bench, uniformly sampled."""

    time: Array
    """(N,) on the bench clock [s]."""
    displacement: Array
    """(N,) [m]"""
    drive: Array
    """(N,) [V or A], held through each sample."""
    shunt: Array = np.zeros(0)
    """(N,) 1 while the shunt of the load cell is on, else 0 [1]; empty for never."""


class RunResult(NamedTuple):
    """Readings, true signals and drawn errors of one run."""

    time: Array
    """(N,) on the bench clock [s]."""
    channels: dict[str, Array]
    """Readings by channel, each (N,)."""
    truth: TrueSignals
    """True signals of the plant."""
    channel_errors: dict[str, ChannelErrors]
    """Errors drawn for each channel."""


def run_offline(
    scenario: Scenario,
    commands: CommandSeries,
    progress: Callable[[float], None] = lambda fraction: None,
    start_temperature: float | None = None,
) -> RunResult:
    """Play commands on the rig of a scenario.

    Args:
        scenario: damper, effects, sensors, clocks and faults.
        commands: at least 10 samples.
        progress: receives the completed fraction, 0 to 1.
        start_temperature: of the damper [degC]; that of the room if None.

    Raises:
        PlantError: the specimen has no finite motion.
    """
    count = len(commands.time)
    dt = float(commands.time[-1] - commands.time[0]) / (count - 1)
    command = apply_start_ramp(scenario, commands.time, commands.displacement)
    targets = np.append(command, command[-1])  # the last sample needs an end as well
    plant, parts = make_plant(scenario, float(command[0]), float(commands.drive[0])), []
    for chunk in split_into_chunks(count, _CHUNK_SAMPLES):
        parts.append(plant.simulate(dt, targets[chunk.start : chunk.stop + 1], commands.drive[chunk]))
        progress(chunk.stop / count)
    truth = TrueSignals(*(np.concatenate(values) for values in zip(*parts, strict=True)))
    elapsed = commands.time - commands.time[0]
    if start_temperature is not None:
        truth = _add_start_temperature(truth, scenario, elapsed, start_temperature)
    shunt = scenario.sensors.force.shunt * commands.shunt
    values, channel_errors = make_readings(scenario, elapsed, truth, shunt)
    return RunResult(commands.time, apply_faults(scenario, elapsed, values), truth, channel_errors)


def _add_start_temperature(truth: TrueSignals, scenario: Scenario, elapsed: Array, start: float) -> TrueSignals:
    """Add the decaying excess over the room with which the damper starts; nothing else depends on it."""
    thermal = scenario.thermal
    excess = (start - thermal.ambient) * np.exp(-thermal.loss / thermal.capacity * elapsed)
    return truth._replace(temperature=truth.temperature + excess)


def read_commands(path: Path) -> CommandSeries:
    """Return the commands in a file of arrays ``time``, ``displacement``, ``drive`` and, if used, ``shunt``.

    Raises:
        CommandsError: the file cannot be read, or the record is not finite, uniform and of one length.
    """
    try:
        with np.load(path) as file:
            names = [name for name in CommandSeries._fields if name != "shunt" or name in file.files]
            commands = CommandSeries(**{name: np.asarray(file[name], float) for name in names})
    except KeyError as error:
        raise CommandsError(f"{path}: {error.args[0]}") from error
    except (OSError, ValueError, EOFError, TypeError, zipfile.BadZipFile) as error:
        raise CommandsError(f"{path}: is not a readable npz file ({error})") from error
    _check_commands(commands, path)
    return commands


def _check_commands(commands: CommandSeries, path: Path) -> None:
    arrays = {name: array for name, array in commands._asdict().items() if name != "shunt" or array.size}
    shapes = {name: array.shape for name, array in arrays.items()}
    if len(set(shapes.values())) > 1 or commands.time.ndim != 1:
        raise CommandsError(f"{path}: the commands differ in shape: {shapes}")
    if len(commands.time) < 10:
        raise CommandsError(f"{path}: {len(commands.time)} samples; at least 10 are needed")
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            raise CommandsError(f"{path}: {name} is not finite at sample {int(np.argmin(np.isfinite(array)))}")
    steps = np.diff(commands.time)
    step = float(np.mean(steps))
    if step <= 0 or np.max(np.abs(steps - step)) > 1e-3 * step:
        raise CommandsError(f"{path}: time is not uniform; resample the commands at one rate")
    if 1.001 / step < _MIN_RATE or 0.999 / step > _MAX_RATE:
        raise CommandsError(f"{path}: {1 / step:.4g} Hz is outside {_MIN_RATE:g} to {_MAX_RATE:g} Hz")


def write_channels(path: Path, scenario: Scenario, result: RunResult) -> None:
    """Write the channels on the bench clock, and the devices' own information, to an npz file."""
    rate = (len(result.time) - 1) / float(result.time[-1] - result.time[0])
    _write_arrays(path, {"time": result.time, **result.channels}, make_device_info(scenario, rate))


def write_truth(path: Path, scenario: Scenario, result: RunResult) -> None:
    """Write the hidden truth to an npz file, for tests and benchmarks; no log may contain it.

    The arrays are at the samples. ``info`` contains the parameters, the effects, and the errors drawn for each
    channel. ``recorded_f0`` [N] is the preload as the log shows it: that of the damper minus the load cell's zero
    shift.
    """
    truth, law = result.truth, scenario.parameters
    substeps = len(truth.position) // len(result.time)
    hidden = {
        "parameters": law._asdict(),
        "recorded_f0": law.k1 * law.x0 - result.channel_errors["force"].zero,
        "effects": [effect.model_dump() for effect in scenario.effects],
        "channel_errors": {name: errors._asdict() for name, errors in result.channel_errors.items()},
    }
    arrays = {
        "time": result.time,
        "displacement": truth.position[::substeps],
        "force": truth.force[::substeps],
        "drive": truth.output,
        "damper_displacement": truth.damper_displacement,
        "damper_velocity": truth.damper_velocity,
        "y": truth.y,
        "z": truth.z,
        "field": truth.field,
        "temperature": truth.temperature,
    }
    _write_arrays(path, arrays, hidden)


def _write_arrays(path: Path, arrays: dict[str, Array], info: dict[str, Any]) -> None:
    contents: dict[str, Any] = {**arrays, "info": np.array(json.dumps(info))}
    with path.open("wb") as file:
        np.savez(file, **contents)


def make_device_info(scenario: Scenario, rate: float) -> dict[str, Any]:
    """Return what the devices report of themselves at a bench rate [Hz]; it reveals nothing to a diagnosis."""
    clocks = {name: {"ppm": clock.ppm, "mapping_std_s": clock.mapping_error} for name, clock in scenario.clocks}
    return {
        "channels": {name: _make_channel_info(scenario, name, rate) for name in CHANNELS},
        "clocks": clocks,
        "drive_kind": scenario.drive_kind,
        "drive_unit": scenario.drive_unit,
        "specimen": scenario.specimen.model_dump(),
    }


def _make_channel_info(scenario: Scenario, name: str, rate: float) -> dict[str, Any]:
    sensor: Sensor = getattr(scenario.sensors, name)
    low_pass = sensor.filter and {
        "kind": sensor.filter.kind,
        "order": sensor.filter.order,
        "cutoff_hz": sensor.filter.cutoff,
    }
    unit = CHANNELS[name][0]
    return {
        "unit": scenario.drive_unit if unit == "drive" else unit,
        "rate_hz": sensor.rate or round(rate, 6),
        "filter": low_pass,
        "delay_s": sensor.delay,
    }

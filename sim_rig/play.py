"""A run on files: commands in, channels out, the truth only where it is asked for.

What the channels file says of the bench (``info``) is what its devices would say of themselves: units, rates,
filters and delays as claimed, clocks as mapped. Nothing of the damper, the effects or the noise is in it.
"""

import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sim_rig.channel import Drawn
from sim_rig.compiled import Array
from sim_rig.errors import CommandsError
from sim_rig.plant import Truth, chunks, faded_in
from sim_rig.scenario import Scenario
from sim_rig.sealed_plant import plant_for
from sim_rig.sensors import CHANNELS, report, with_faults
from sim_rig.settings import Sensor

_CHUNK = 10_000
"""Samples between two reports of progress."""
_SLOWEST, _FASTEST = 50.0, 20_000.0
"""[Hz] sampling rates that the rig plays."""


class Commands(NamedTuple):
    """What the bench commands, uniformly sampled."""

    time: Array
    """(N,) on the bench clock [s]."""
    displacement: Array
    """(N,) [m]"""
    drive: Array
    """(N,) [V or A], held through each sample."""


class Played(NamedTuple):
    """One run."""

    time: Array
    """(N,) on the bench clock [s]."""
    channels: dict[str, Array]
    """Readings by channel, each (N,)."""
    truth: Truth
    """What happened."""
    drawn: dict[str, Drawn]
    """What chance gave each channel."""


def play(scenario: Scenario, commands: Commands, progress: Callable[[float], None] = lambda done: None) -> Played:
    """Play commands on the rig of a scenario.

    Args:
        scenario: what is real today.
        commands: at least 10 samples.
        progress: told the part that is done, 0 to 1.

    Raises:
        PlantError: the specimen has no finite motion.
    """
    count = len(commands.time)
    dt = float(commands.time[-1] - commands.time[0]) / (count - 1)
    command = faded_in(scenario, commands.time, commands.displacement)
    ahead = np.append(command, command[-1])  # the last sample, too, has an end to go to
    plant, parts = plant_for(scenario, float(command[0]), float(commands.drive[0])), []
    for part in chunks(count, _CHUNK):
        parts.append(plant.play(dt, ahead[part.start : part.stop + 1], commands.drive[part]))
        progress(part.stop / count)
    truth = Truth(*(np.concatenate(values) for values in zip(*parts, strict=True)))
    since = commands.time - commands.time[0]
    values, drawn = report(scenario, since, truth)
    return Played(commands.time, with_faults(scenario, since, values), truth, drawn)


def read_commands(path: Path) -> Commands:
    """The commands in a file of arrays ``time``, ``displacement``, ``drive``.

    Raises:
        CommandsError: the file cannot be read, or the record is not finite, uniform and of one length.
    """
    try:
        with np.load(path) as file:
            commands = Commands(*(np.asarray(file[name], float) for name in Commands._fields))
    except KeyError as error:
        raise CommandsError(f"{path}: {error.args[0]}") from error
    except (OSError, ValueError, EOFError, TypeError, zipfile.BadZipFile) as error:
        raise CommandsError(f"{path}: no readable file of arrays ({error})") from error
    _check(commands, path)
    return commands


def _check(commands: Commands, path: Path) -> None:
    shapes = {name: array.shape for name, array in commands._asdict().items()}
    if len(set(shapes.values())) > 1 or commands.time.ndim != 1:
        raise CommandsError(f"{path}: time, displacement and drive differ in shape: {shapes}")
    if len(commands.time) < 10:
        raise CommandsError(f"{path}: {len(commands.time)} samples; at least 10 are needed")
    for name, array in commands._asdict().items():
        if not np.isfinite(array).all():
            raise CommandsError(f"{path}: {name} is not finite at sample {int(np.argmin(np.isfinite(array)))}")
    steps = np.diff(commands.time)
    step = float(np.mean(steps))
    if step <= 0 or np.max(np.abs(steps - step)) > 1e-3 * step:
        raise CommandsError(f"{path}: time is not uniform; resample the commands at one rate")
    if 1.001 / step < _SLOWEST or 0.999 / step > _FASTEST:
        raise CommandsError(f"{path}: {1 / step:.4g} Hz lies outside {_SLOWEST:g} to {_FASTEST:g} Hz")


def write_channels(path: Path, scenario: Scenario, played: Played) -> None:
    """Write the channels on the bench clock, and what the devices say of themselves, to an npz file."""
    rate = (len(played.time) - 1) / float(played.time[-1] - played.time[0])
    _write(path, {"time": played.time, **played.channels}, info(scenario, rate))


def write_truth(path: Path, scenario: Scenario, played: Played) -> None:
    """Write the hidden truth to an npz file: for tests and benchmarks, never for a log.

    Arrays are at the samples; ``info`` holds the parameters, the effects, what chance drew for each channel, and
    ``recorded_f0`` [N], the preload as the log shows it: that of the damper less the zero shift of the load cell.
    """
    truth, law = played.truth, scenario.parameters
    blocks = len(truth.position) // len(played.time)
    hidden = {
        "parameters": law._asdict(),
        "recorded_f0": law.k1 * law.x0 - played.drawn["force"].zero,
        "effects": [effect.model_dump() for effect in scenario.effects],
        "drawn": {name: drawn._asdict() for name, drawn in played.drawn.items()},
    }
    arrays = {
        "time": played.time,
        "displacement": truth.position[::blocks],
        "force": truth.force[::blocks],
        "drive": truth.output,
        "damper_displacement": truth.damper_displacement,
        "damper_velocity": truth.damper_velocity,
        "y": truth.y,
        "z": truth.z,
        "field": truth.field,
        "temperature": truth.temperature,
    }
    _write(path, arrays, hidden)


def _write(path: Path, arrays: dict[str, Array], facts: dict[str, Any]) -> None:
    named: dict[str, Any] = {**arrays, "info": np.array(json.dumps(facts))}
    with path.open("wb") as file:
        np.savez(file, **named)


def info(scenario: Scenario, rate: float) -> dict[str, Any]:
    """What the devices say of themselves at a bench rate [Hz]: nothing of what a diagnosis has to find."""
    clocks = {name: {"ppm": clock.ppm, "mapping_std_s": clock.mapping_error} for name, clock in scenario.clocks}
    return {
        "channels": {name: _channel_info(scenario, name, rate) for name in CHANNELS},
        "clocks": clocks,
        "drive_kind": scenario.drive_kind,
        "drive_unit": scenario.drive_unit,
        "specimen": scenario.specimen.model_dump(),
    }


def _channel_info(scenario: Scenario, name: str, rate: float) -> dict[str, Any]:
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

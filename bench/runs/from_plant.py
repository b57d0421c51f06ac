"""Single run on the simulated plant without wires, from the method to the log."""

import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from bench.errors import RunError
from bench.log import ChannelInfo, Identity, LogWriter, RunHeader, serialise_values, smooth_velocity
from bench.methods import Method, Programme, ProgrammeSegment, compile_method
from bench.progress import Progress
from bench.runs.plant_process import RIG_COMMAND, RigChannels, play_scenario

REQUIRED_CHANNELS = ("displacement", "force", "coil_drive")
"""Channels that every sample needs; without one of them it is lost."""
OPTIONAL_CHANNELS = ("actuator_position", "coil_current", "coil_voltage", "temperature")
"""Channels that are recorded if the rig has them."""
RESAMPLING_NOTE = "each sample takes a channel's latest reading on the bench clock; slower channels hold theirs"
CALIBRATION_NOTE = "as reported by the simulated instrument"

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Column = Array | Integers
LogAction = Callable[[LogWriter], None]


def run_from_plant(
    method: Method,
    scenario: str,
    out: Path,
    identity: Identity,
    progress: Progress = lambda share: None,
    *,
    seed: int | None = None,
    rig: Sequence[str] = RIG_COMMAND,
    continues: str = "",
    resumed_after: str = "",
) -> Programme:
    """Record a method on the simulated plant of a scenario.

    The log is opened after the rig has played the whole method, so a rig that fails leaves no log.

    Args:
        method: the method to run.
        scenario: name or file of the scenario; only its name goes into the log.
        out: file of the log.
        identity: specimen, operator and start.
        progress: receives the completed share, 0 to 1.
        seed: seed of all random numbers of the rig; the scenario's own if None.
        rig: command that starts the rig.
        continues: id of the run that this one continues or repeats; empty without one.
        resumed_after: checkpoint after which the method begins; empty for a whole run.

    Returns:
        The programme that was run.

    Raises:
        MethodError: the method cannot be compiled within its limits.
        RunError: the folder of the log does not exist, the rig fails, or method and rig drive in different units.
        LogError: the log cannot be written.
    """
    if not out.parent.is_dir():
        raise RunError(f"{out} cannot be written: the folder {out.parent} does not exist; create it first")
    programme = compile_method(method)
    commands = _make_commands(programme)
    options = () if seed is None else ("--seed", str(seed))
    rig_channels = play_scenario(scenario, commands, progress, (*rig, *options))
    if rig_channels.info["drive_unit"] != method.drive_unit:
        raise RunError(
            f"method {method.name} drives in {method.drive_unit}, the scenario {scenario} in"
            f" {rig_channels.info['drive_unit']}; use a method with the drive_kind"
            f" {rig_channels.info['drive_kind']}"
        )
    values = _make_columns(programme, rig_channels)
    header = _make_header(method, rig_channels, identity, seed)
    parts = {"continues": continues, "resumed_after": resumed_after}
    with LogWriter(out, header.model_copy(update=parts)) as log:
        _write_log(log, programme, rig_channels, values, Path(scenario).stem)
    return programme


def _make_commands(programme: Programme) -> dict[str, Array]:
    """Return the commands of the rig; the shunt only if it is used, because other rigs may not have one."""
    commands = {"time": programme.time, "displacement": programme.displacement, "drive": programme.drive}
    shunted = [segment.index for segment in programme.segments if segment.shunt]
    return {**commands, "shunt": np.isin(programme.segment, shunted).astype(float)} if shunted else commands


def _make_header(method: Method, rig_channels: RigChannels, identity: Identity, seed: int | None) -> RunHeader:
    info = rig_channels.info
    return RunHeader(
        id=identity.make_run_id(method.name),
        specimen=identity.specimen or _format_specimen(info.get("specimen", {})),
        method=method.name,
        method_sha256=method.compute_sha256(),
        operator=identity.operator,
        drive_kind=info["drive_kind"],
        drive_unit=info["drive_unit"],
        source="run",
        versions={"mrbench": version("mrbench"), "python": platform.python_version(), "numpy": np.__version__},
        seed=seed,
        utc_offset=identity.started.isoformat(),
        velocity_from="smoothed displacement",
        resampled=RESAMPLING_NOTE,
        calibration=dict.fromkeys(info["channels"], CALIBRATION_NOTE),
        clocks=serialise_values(info["clocks"]),
        channels={name: _make_channel_info(channel) for name, channel in info["channels"].items()},
    )


def _make_channel_info(channel: Mapping[str, Any]) -> ChannelInfo:
    return ChannelInfo(**{key: value for key, value in channel.items() if key in ChannelInfo.model_fields})


def _format_specimen(specimen: dict[str, Any]) -> str:
    return ", ".join(str(value) for value in specimen.values())


def _write_log(
    log: LogWriter, programme: Programme, rig_channels: RigChannels, values: dict[str, Column], scenario: str
) -> None:
    """Write attachments and samples, with segment marks and events at their places among them."""
    log.attach("method.json", "application/json", programme.method.to_json().encode())
    log.attach("scenario.txt", "text/plain", f"{scenario}\n".encode())
    time_ns = np.round(rig_channels.channels["time"] * 1e9).astype(np.int64)
    complete = np.all([np.isfinite(values[name]) for name in REQUIRED_CHANNELS], axis=0)
    kept_before = np.concatenate([[0], np.cumsum(complete)])
    kept_ns, kept = time_ns[complete], {name: column[complete] for name, column in values.items()}
    written = 0
    # Sorted by sample only, so that actions at the same sample keep their order: an end before a start.
    for sample, action in sorted(_make_actions(programme, rig_channels, time_ns, scenario), key=itemgetter(0)):
        # Marks refer to the programme's samples, some of which may have been lost.
        stop = int(kept_before[sample])
        _write_samples(log, kept_ns, kept, slice(written, stop))
        action(log)
        written = stop
    _write_samples(log, kept_ns, kept, slice(written, None))
    _count_lost(log, values)


def _count_lost(log: LogWriter, values: Mapping[str, Column]) -> None:
    for name in (*REQUIRED_CHANNELS, *OPTIONAL_CHANNELS):
        if missing := int(np.count_nonzero(np.isnan(values.get(name, np.zeros(1))))):
            log.count_lost(name, missing)


def _write_samples(log: LogWriter, time_ns: Integers, values: Mapping[str, Column], part: slice) -> None:
    log.write_samples(time_ns[part], {name: column[part] for name, column in values.items()})


def _make_columns(programme: Programme, rig_channels: RigChannels) -> dict[str, Column]:
    """Return the fields of all samples; NaN for a reading that the rig lost."""
    channels = rig_channels.channels
    return {
        **{name: channels[name] for name in (*REQUIRED_CHANNELS, *OPTIONAL_CHANNELS) if name in channels},
        "velocity": _compute_velocity(channels["displacement"], programme.rate),
        "displacement_command": programme.displacement,
        "coil_drive_command": programme.drive,
        "segment": programme.segment,
    }


def _compute_velocity(displacement: Array, rate: float) -> Array:
    """Compute the velocity [m/s] of a displacement [m]; lost readings are interpolated linearly."""
    valid = np.flatnonzero(np.isfinite(displacement))
    if valid.size == 0:
        raise RunError("the rig lost every reading of displacement; nothing was recorded")
    return smooth_velocity(np.interp(np.arange(len(displacement)), valid, displacement[valid]), rate)


def _make_actions(
    programme: Programme, rig_channels: RigChannels, time_ns: Integers, scenario: str
) -> Iterator[tuple[int, LogAction]]:
    """Yield segment marks and events: number of samples before each, and the action that writes it."""
    method = programme.method
    yield 0, _make_event_action(time_ns[0], "state", f"run of method {method.name} started", scenario=scenario)
    for segment in programme.segments:
        yield from _make_segment_actions(segment, time_ns, method.name)
    force = np.abs(rig_channels.channels["force"])
    if np.any(above := force > method.limits.force_n):
        first = int(np.argmax(above))
        text = f"force {force[first]:.1f} N exceeds the method's limit of {method.limits.force_n:g} N"
        details = {"quantity": "force", "value": float(force[first]), "limit": method.limits.force_n}
        yield first, _make_event_action(time_ns[first], "alarm", text, **details)
    yield len(time_ns), _make_event_action(time_ns[-1], "state", "run finished")


def _make_segment_actions(
    segment: ProgrammeSegment, time_ns: Integers, method: str
) -> Iterator[tuple[int, LogAction]]:
    first, last = int(time_ns[segment.start]), int(time_ns[segment.stop - 1])
    yield segment.start, _make_segment_action(first, "start", segment, method)
    yield segment.start, _make_event_action(first, "state", f"segment {segment.name} started")
    yield segment.stop, _make_segment_action(last, "end", segment, method)
    if segment.checkpoint:
        yield segment.stop, _make_event_action(last, "checkpoint", f"after segment {segment.name}")


def _make_event_action(time_ns: np.int64 | int, kind: str, text: str, **details: Any) -> LogAction:
    return lambda log: log.write_event(int(time_ns), kind, text, **details)


def _make_segment_action(time_ns: int, phase: Any, segment: ProgrammeSegment, stretch: str) -> LogAction:
    fields = {key: value for key, value in asdict(segment).items() if key not in ("start", "stop", "checkpoint")}
    return lambda log: log.write_segment(time_ns, phase=phase, stretch=stretch, **fields)

"""One run straight from the simulated plant: method to samples, samples to the rig, its channels to a log."""

import platform
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from importlib.metadata import version
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from bench.errors import RunError
from bench.methods import Method, Programme, ProgrammeSegment, compile_method
from bench.recorder.header import Channel, RunHeader, text_values
from bench.recorder.velocity import smooth_velocity
from bench.recorder.writer import LogWriter
from bench.rig_process import RIG, RigChannels, play

REQUIRED = ("displacement", "force", "coil_drive")
"""Channels without which a sample is lost."""
OPTIONAL = ("actuator_position", "coil_current", "coil_voltage", "temperature")
"""Channels that are recorded where the rig has them."""
RESAMPLED = "each sample takes a channel's latest reading on the bench clock; slower channels hold theirs"
CALIBRATION = "as reported by the simulated instrument"

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Column = Array | Integers
Action = Callable[[LogWriter], None]


@dataclass(frozen=True)
class Identity:
    """Whose run it is, and when it began."""

    specimen: str
    """The damper under test; empty for what the rig reports."""
    operator: str
    started: datetime
    """UTC at zero of the bench clock."""

    def run_id(self, method: Method) -> str:
        """Identifier of the run: when, and what."""
        return f"{self.started:%Y%m%dT%H%M%S.%fZ}-{method.name}"


def run_from_plant(
    method: Method,
    scenario: str,
    out: Path,
    identity: Identity,
    progress: Callable[[float], None] = lambda share: None,
    *,
    seed: int | None = None,
    rig: Sequence[str] = RIG,
) -> Programme:
    """Record a method from a scenario.

    The log is opened only once the rig has played the whole method, so a rig that fails leaves no log behind.

    Args:
        method: what to do.
        scenario: name or file of the scenario; only its name goes into the log.
        out: the log.
        identity: whose run it is.
        progress: told the share done, 0 to 1.
        seed: of everything that chance decides on the rig; the scenario's own if None.
        rig: the command that starts the rig.

    Returns:
        The programme that was run.

    Raises:
        MethodError: the method cannot be compiled within its limits.
        RunError: there is no folder for the log, the rig fails, or it is driven otherwise than the method says.
        LogError: the log cannot be written.
    """
    if not out.parent.is_dir():
        raise RunError(f"{out} cannot be written: there is no folder {out.parent}")
    programme = compile_method(method)
    commands = {"time": programme.time, "displacement": programme.displacement, "drive": programme.drive}
    options = () if seed is None else ("--seed", str(seed))
    found = play(scenario, commands, progress, (*rig, *options))
    if found.info["drive_unit"] != method.drive_unit:
        raise RunError(
            f"method {method.name} drives in {method.drive_unit}, the scenario {scenario} in "
            f"{found.info['drive_unit']}; take a method with the drive_kind {found.info['drive_kind']}"
        )
    values = _sample_values(programme, found)
    with LogWriter(out, _header(method, found, identity, seed)) as log:
        _record(log, programme, found, values, Path(scenario).stem)
    return programme


def _header(method: Method, found: RigChannels, identity: Identity, seed: int | None) -> RunHeader:
    info = found.info
    known = Channel.model_fields
    return RunHeader(
        id=identity.run_id(method),
        specimen=identity.specimen or _specimen_name(info.get("specimen", {})),
        method=method.name,
        operator=identity.operator,
        drive_kind=info["drive_kind"],
        drive_unit=info["drive_unit"],
        source="run",
        versions={"mrbench": version("mrbench"), "python": platform.python_version(), "numpy": np.__version__},
        seed=seed,
        utc_offset=identity.started.isoformat(),
        velocity_from="smoothed displacement",
        resampled=RESAMPLED,
        calibration=dict.fromkeys(info["channels"], CALIBRATION),
        clocks=text_values(info["clocks"]),
        channels={
            name: Channel(**{key: value for key, value in channel.items() if key in known})
            for name, channel in info["channels"].items()
        },
    )


def _specimen_name(specimen: dict[str, Any]) -> str:
    return ", ".join(str(value) for value in specimen.values())


def _record(
    log: LogWriter, programme: Programme, found: RigChannels, values: dict[str, Column], scenario: str
) -> None:
    """Write documents, samples, and at their place among them segments and events."""
    method = programme.method
    log.attach("method.json", "application/json", method.to_json().encode())
    log.attach("scenario.txt", "text/plain", f"{scenario}\n".encode())
    time_ns = np.round(found.channels["time"] * 1e9).astype(np.int64)
    whole = np.all([np.isfinite(values[name]) for name in REQUIRED], axis=0)
    kept_before = np.concatenate([[0], np.cumsum(whole)])
    kept_ns, kept = time_ns[whole], {name: column[whole] for name, column in values.items()}
    done = 0
    # By the place alone: at one place they stay in the order in which they came, an end before a start.
    for sample, action in sorted(_actions(programme, found, time_ns, scenario), key=itemgetter(0)):
        # Marks count the programme's samples, of which some may have been lost.
        place = int(kept_before[sample])
        _write(log, kept_ns, kept, slice(done, place))
        action(log)
        done = place
    _write(log, kept_ns, kept, slice(done, None))
    for name in (*REQUIRED, *OPTIONAL):
        if missing := int(np.count_nonzero(np.isnan(values.get(name, np.zeros(1))))):
            log.lost(name, missing)


def _write(log: LogWriter, time_ns: Integers, values: Mapping[str, Column], part: slice) -> None:
    log.samples(time_ns[part], {name: column[part] for name, column in values.items()})


def _sample_values(programme: Programme, found: RigChannels) -> dict[str, Column]:
    """The fields of all samples; NaN where the rig lost a reading."""
    channels = found.channels
    return {
        **{name: channels[name] for name in (*REQUIRED, *OPTIONAL) if name in channels},
        "velocity": _velocity(channels["displacement"], programme.rate),
        "displacement_command": programme.displacement,
        "coil_drive_command": programme.drive,
        "segment": programme.segment,
    }


def _velocity(displacement: Array, rate: float) -> Array:
    """Velocity [m/s] of a displacement [m] in which lost readings are bridged by straight lines."""
    there = np.flatnonzero(np.isfinite(displacement))
    if there.size == 0:
        raise RunError("the rig lost every reading of displacement; nothing was recorded")
    return smooth_velocity(np.interp(np.arange(len(displacement)), there, displacement[there]), rate)


def _actions(
    programme: Programme, found: RigChannels, time_ns: Integers, scenario: str
) -> Iterator[tuple[int, Action]]:
    """What is written between samples: how many samples stand before it, and how it is written."""
    method = programme.method
    yield 0, _event(time_ns[0], "state", f"run of method {method.name} started", scenario=scenario)
    for segment in programme.segments:
        first, last = int(time_ns[segment.start]), int(time_ns[segment.stop - 1])
        yield segment.start, _segment(first, "start", segment, method.name)
        yield segment.start, _event(first, "state", f"segment {segment.name} started")
        yield segment.stop, _segment(last, "end", segment, method.name)
        if segment.checkpoint:
            yield segment.stop, _event(last, "checkpoint", f"after segment {segment.name}")
    force = np.abs(found.channels["force"])
    if np.any(above := force > method.limits.force_n):
        first = int(np.argmax(above))
        text = f"force {force[first]:.1f} N exceeds the method's limit of {method.limits.force_n:g} N"
        judged = {"quantity": "force", "value": float(force[first]), "limit": method.limits.force_n}
        yield first, _event(time_ns[first], "alarm", text, **judged)
    yield len(time_ns), _event(time_ns[-1], "state", "run finished")


def _event(time_ns: np.int64 | int, kind: str, text: str, **more: Any) -> Action:
    return lambda log: log.event(int(time_ns), kind, text, **more)


def _segment(time_ns: int, phase: Any, segment: ProgrammeSegment, stretch: str) -> Action:
    fields = {key: value for key, value in asdict(segment).items() if key not in ("start", "stop", "checkpoint")}
    return lambda log: log.segment(time_ns, phase=phase, stretch=stretch, **fields)

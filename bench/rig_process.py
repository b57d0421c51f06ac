"""The simulated rig as a process of its own: commands in, channels out, both as files.

Nothing of the rig is imported; what a real specimen would hide stays hidden in the other process.
"""

import queue
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import BadZipFile

import numpy as np
import numpy.typing as npt
import orjson

from bench.child_process import Lines, read_along
from bench.errors import RunError

Array = npt.NDArray[np.float64]

RIG = (sys.executable, "-m", "sim_rig", "play")
"""Command that plays a scenario; options follow."""
LONGEST_SILENCE = 300.0
"""[s] without a sign of life after which the rig is given up; its first start compiles."""


@dataclass(frozen=True)
class RigChannels:
    """What the rig has measured, on the bench clock."""

    channels: dict[str, Array]
    """By name, each of shape (samples,), in the unit that ``info`` says; beside them ``time`` [s]."""
    info: dict[str, Any]
    """What the rig says of channels, clocks, drive and specimen."""


def play(
    scenario: str,
    commands: dict[str, Array],
    progress: Callable[[float], None] = lambda share: None,
    rig: Sequence[str] = RIG,
) -> RigChannels:
    """Play commands on the simulated rig.

    Args:
        scenario: name or file of the scenario.
        commands: ``time`` [s], ``displacement`` [m] and ``drive`` [V or A], each of shape (samples,).
        progress: told the share done, 0 to 1.
        rig: the command that starts the rig.

    Raises:
        RunError: the rig cannot be started, fails, falls silent or leaves no usable channels.
    """
    with TemporaryDirectory(prefix="mrbench-") as folder:
        given, found = Path(folder) / "commands.npz", Path(folder) / "channels.npz"
        np.savez(given, **commands)  # type: ignore[arg-type]  # its stub takes every keyword for allow_pickle
        options = ("--scenario", scenario, "--commands", str(given), "--out", str(found))
        _run([*rig, *options], progress)
        return _read(found, len(commands["time"]))


def _run(command: list[str], progress: Callable[[float], None]) -> None:
    """Run the process to its end, passing on its progress; its last other line is its complaint."""
    try:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
    except OSError as error:
        raise RunError(f"the simulated rig cannot be started: {error}") from None
    with process:
        lines, reader = read_along(process)
        try:
            complaint = _follow(lines, progress)
            process.wait(LONGEST_SILENCE)
        except (queue.Empty, subprocess.TimeoutExpired):
            raise RunError(f"the simulated rig was silent for {LONGEST_SILENCE:g} s and was stopped") from None
        finally:
            # Harmless where it has ended; elsewhere the reader would wait for a pipe that stays open.
            process.kill()
            reader.join()
    if process.returncode != 0:
        complaint = complaint.removeprefix("sim_rig: ")
        raise RunError(f"the simulated rig failed: {complaint or f'exit status {process.returncode}'}")


def _follow(lines: Lines, progress: Callable[[float], None]) -> str:
    """Read to the last line, each within the longest silence; what is no progress is the complaint."""
    complaint = ""
    while (line := lines.get(timeout=LONGEST_SILENCE)) is not None:
        share = _share(line)
        if share is not None:
            progress(share)
        elif line.strip():
            complaint = line.strip()
    return complaint


def _share(line: str) -> float | None:
    """The share done, where the line is a progress line."""
    try:
        return float(orjson.loads(line)["progress"])
    except (ValueError, TypeError, KeyError):
        return None


def _read(path: Path, samples: int) -> RigChannels:
    """The channels that the rig has left.

    Raises:
        RunError: the file is missing, unreadable, or of another length than the commands.
    """
    try:
        with np.load(path) as content:
            info = orjson.loads(str(content["info"]))
            channels = {name: np.asarray(content[name], np.float64) for name in content.files if name != "info"}
    except (OSError, KeyError, ValueError, BadZipFile) as error:
        raise RunError(f"the simulated rig left no usable channels: {error}") from None
    for name in ("time", "displacement", "force", "coil_drive"):
        if name not in channels:
            raise RunError(f"the simulated rig left no channel {name}")
    for name, values in channels.items():
        if values.shape != (samples,):
            raise RunError(f"the simulated rig left {values.size} values of {name} for {samples} commands")
    return RigChannels(channels, info)

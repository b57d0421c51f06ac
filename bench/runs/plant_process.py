"""Simulated rig as a process of its own, which reads commands from a file and writes its channels to another.

Nothing of the rig is imported, so the hidden parameters of the specimen stay in the other process.
"""

import queue
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import BadZipFile

import numpy as np
import numpy.typing as npt
import orjson

from bench.errors import RunError
from bench.processes import LineQueue, start_line_reader
from bench.progress import Progress

Array = npt.NDArray[np.float64]

RIG_COMMAND = (sys.executable, "-m", "sim_rig", "play")
"""Command that plays a scenario; options follow."""
SILENCE_TIMEOUT = 300.0
"""[s] Time without output after which the rig is stopped; its first start compiles."""


@dataclass(frozen=True)
class RigChannels:
    """Measured channels of the rig on the bench clock."""

    channels: dict[str, Array]
    """By name, each of shape (samples,), in the unit that ``info`` states; also ``time`` [s]."""
    info: dict[str, Any]
    """Description of channels, clocks, drive and specimen by the rig."""


def play_scenario(
    scenario: str,
    commands: dict[str, Array],
    progress: Progress = lambda share: None,
    rig: Sequence[str] = RIG_COMMAND,
    silence_timeout: float = SILENCE_TIMEOUT,
) -> RigChannels:
    """Play commands on the simulated rig.

    Args:
        scenario: name or file of the scenario.
        commands: ``time`` [s], ``displacement`` [m], ``drive`` [V or A] and, if used, ``shunt`` (1 while it is on,
            else 0), each of shape (samples,).
        progress: receives the completed share, 0 to 1.
        rig: command that starts the rig.
        silence_timeout: time without output after which the rig is stopped [s].

    Raises:
        RunError: the rig cannot be started, fails, is silent for too long or returns no usable channels.
    """
    with TemporaryDirectory(prefix="mrbench-") as folder:
        given, measured = Path(folder) / "commands.npz", Path(folder) / "channels.npz"
        np.savez(given, **commands)  # type: ignore[arg-type]  # its stub takes every keyword for allow_pickle
        options = ("--scenario", scenario, "--commands", str(given), "--out", str(measured))
        _run_rig([*rig, *options], progress, silence_timeout)
        return _read_channels(measured, len(commands["time"]))


def _start_rig(command: list[str]) -> "subprocess.Popen[str]":
    try:
        # Its standard output is not read, and as a pipe would block the rig once it is full.
        return subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
    except OSError as error:
        raise RunError(f"the simulated rig cannot be started: {error}") from None


def _run_rig(command: list[str], progress: Progress, silence_timeout: float) -> None:
    """Run the process to its end and pass on its progress; its last other line is its error message."""
    with _start_rig(command) as process:
        lines, reader = start_line_reader(process)
        try:
            message = _follow_progress(lines, progress, silence_timeout)
            process.wait(silence_timeout)
        except (queue.Empty, subprocess.TimeoutExpired):
            raise RunError(f"the simulated rig was silent for {silence_timeout:g} s and was stopped") from None
        finally:
            # Harmless after its end; before it, the reader would wait for an open pipe.
            process.kill()
            reader.join()
    if process.returncode != 0:
        message = message.removeprefix("sim_rig: ")
        raise RunError(f"the simulated rig failed: {message or f'exit status {process.returncode}'}")


def _follow_progress(lines: LineQueue, progress: Progress, silence_timeout: float) -> str:
    """Read lines until the end of the process, each within the silence timeout [s]; return the error message."""
    message = ""
    while (line := lines.get(timeout=silence_timeout)) is not None:
        share = _parse_progress(line)
        if share is not None:
            progress(share)
        elif line.strip():
            message = line.strip()
    return message


def _parse_progress(line: str) -> float | None:
    """Return the completed share of a progress line; None for any other line."""
    try:
        return float(orjson.loads(line)["progress"])
    except (ValueError, TypeError, KeyError):
        return None


def _read_channels(path: Path, samples: int) -> RigChannels:
    """Read the measured channels.

    Raises:
        RunError: the file is missing, unreadable, or differs in length from the commands.
    """
    try:
        with np.load(path) as content:
            info = orjson.loads(str(content["info"]))
            channels = {name: np.asarray(content[name], np.float64) for name in content.files if name != "info"}
    except (OSError, KeyError, ValueError, BadZipFile) as error:
        raise RunError(f"the simulated rig returned no usable channels: {error}") from None
    for name in ("time", "displacement", "force", "coil_drive"):
        if name not in channels:
            raise RunError(f"the simulated rig returned no channel {name}")
    for name, values in channels.items():
        if values.shape != (samples,):
            raise RunError(f"the simulated rig returned {values.size} values of {name} for {samples} commands")
    return RigChannels(channels, info)

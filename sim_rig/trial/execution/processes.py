"""Commands of the product as processes: the trial uses the same interface as a user."""

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from sim_rig.errors import TrialError

MRBENCH = (sys.executable, "-m", "bench.cli")
"""The product's command line."""
COMMAND_TIMEOUT = 3600.0
"""[s] timeout of a command."""


class CommandFailedError(TrialError):
    """A command of the product failed."""


def run_command(arguments: Sequence[str | Path], *, real_time: bool = False) -> None:
    """Run a command to its end in an empty folder, with the lowest priority unless it runs in real time.

    Raises:
        CommandFailedError: it could not be started, failed, or took too long; the message contains its last line.
    """
    command = [str(argument) for argument in arguments]
    with TemporaryDirectory(prefix="mrbench-trial-") as folder:
        try:
            process = subprocess.run(
                command if real_time else [*_make_nice_prefix(), *command],
                cwd=folder,
                env=make_environment(),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                timeout=COMMAND_TIMEOUT,
                check=False,
            )
        except OSError as error:
            raise CommandFailedError(f"{command[0]} cannot be started: {error}") from error
        except subprocess.TimeoutExpired as error:
            raise CommandFailedError(
                f"{_format_command(command)} did not end within {COMMAND_TIMEOUT:g} s"
            ) from error
    if process.returncode != 0:
        lines = [line for line in process.stderr.splitlines() if line.strip()]
        message = lines[-1] if lines else "no message"
        raise CommandFailedError(f"{_format_command(command)} ended with {process.returncode}: {message}")


def make_environment() -> dict[str, str]:
    """Return an environment with one numerical thread per process, as several processes run in parallel."""
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**os.environ, **threads}


def _make_nice_prefix() -> list[str]:
    nice = shutil.which("nice")
    return [nice, "-n", "19"] if nice else []


def _format_command(command: Sequence[str]) -> str:
    """Return the name of a command, without the interpreter that runs it."""
    words = list(command[len(MRBENCH) :]) if tuple(command[: len(MRBENCH)]) == MRBENCH else list(command)
    return " ".join(["mrbench", *words[:1]]) if words != list(command) else Path(words[0]).name

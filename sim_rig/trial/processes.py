"""The product's commands as processes: the trial sees of it what a user sees."""

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
LONGEST = 3600.0
"""[s] after which a command is given up."""


class CommandFailedError(TrialError):
    """A command of the product ended without an answer."""


def call(words: Sequence[str | Path], *, in_real_time: bool = False) -> None:
    """Run a command to its end, in an empty folder, with the lowest priority unless it has to keep time.

    Raises:
        CommandFailedError: it could not be started, failed, or took too long; the message is its complaint.
    """
    command = [str(word) for word in words]
    with TemporaryDirectory(prefix="mrbench-trial-") as elsewhere:
        try:
            ended = subprocess.run(
                command if in_real_time else [*_nicely(), *command],
                cwd=elsewhere,
                env=environment(),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                timeout=LONGEST,
                check=False,
            )
        except OSError as error:
            raise CommandFailedError(f"{command[0]} cannot be started: {error}") from error
        except subprocess.TimeoutExpired as error:
            raise CommandFailedError(f"{_named(command)} had no answer within {LONGEST:g} s") from error
    if ended.returncode != 0:
        lines = [line for line in ended.stderr.splitlines() if line.strip()]
        complaint = lines[-1] if lines else "no complaint"
        raise CommandFailedError(f"{_named(command)} ended with {ended.returncode}: {complaint}")


def environment() -> dict[str, str]:
    """One thread for each process: several run side by side."""
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return {**os.environ, **threads}


def _nicely() -> list[str]:
    nice = shutil.which("nice")
    return [nice, "-n", "19"] if nice else []


def _named(command: Sequence[str]) -> str:
    """The command without the interpreter that runs it."""
    words = list(command[len(MRBENCH) :]) if tuple(command[: len(MRBENCH)]) == MRBENCH else list(command)
    return " ".join(["mrbench", *words[:1]]) if words != list(command) else Path(words[0]).name

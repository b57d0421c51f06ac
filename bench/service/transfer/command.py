"""Commands of mrbench as processes of the lowest priority, so that no request delays a stop or a recording."""

import os
import subprocess
from collections.abc import Sequence

from bench.errors import BenchError
from bench.processes import MRBENCH_COMMAND

LOWEST_PRIORITY = 19
TIMEOUT = 600.0
"""Time limit of a command [s]."""


def run_command(arguments: Sequence[str], error: type[BenchError]) -> None:
    """Run a command of mrbench and wait for its end.

    Args:
        arguments: arguments after `mrbench`.
        error: type of the error if the command fails; its text is the one line that the command prints.
    """
    with subprocess.Popen(
        [*MRBENCH_COMMAND, *arguments],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
    ) as process:
        os.setpriority(os.PRIO_PROCESS, process.pid, LOWEST_PRIORITY)
        try:
            text = process.communicate(timeout=TIMEOUT)[1]
        except subprocess.TimeoutExpired:
            process.kill()
            raise error(f"mrbench {arguments[0]} took longer than {TIMEOUT:g} s; use the command line") from None
    if process.returncode != 0:
        lines = text.strip().splitlines() or [f"mrbench {arguments[0]}: exit status {process.returncode}"]
        raise error(lines[-1].removeprefix("mrbench: "))

"""Processes that this one has started: what they say while they work, and their end."""

import queue
import subprocess
import sys
import threading
from typing import TypeAlias

Lines: TypeAlias = "queue.Queue[str | None]"
"""What a process says, line by line; None once all is said."""
MRBENCH = (sys.executable, "-m", "bench.cli")
"""The command line as a process: of this environment, whatever stands on the path."""


def read_along(process: "subprocess.Popen[str]") -> tuple[Lines, threading.Thread]:
    """The lines of a process's standard error as they come, and the thread that reads them.

    A pipe knows no deadline, a queue does. The thread ends when the pipe does: join it before the pipe is closed.
    """
    lines: Lines = queue.Queue()
    reader = threading.Thread(target=_pump, args=(process, lines), daemon=True)
    reader.start()
    return lines, reader


def _pump(process: "subprocess.Popen[str]", lines: Lines) -> None:
    if process.stderr is not None:
        for line in process.stderr:
            lines.put(line)
    lines.put(None)


def end(process: "subprocess.Popen[bytes]", within: float) -> None:
    """Ask a process to end, and end it where it has not done so ``within`` so many seconds."""
    process.terminate()
    try:
        process.wait(within)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()

"""Child processes: their output lines and their end; signals as events."""

import contextlib
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, TypeAlias

LineQueue: TypeAlias = "queue.Queue[str | None]"
"""Lines of a process's standard error, then None at its end."""
MRBENCH_COMMAND = (sys.executable, "-m", "bench.cli")
"""Command line of this environment as a process, whatever is on the search path."""


def start_line_reader(process: "subprocess.Popen[str]") -> tuple[LineQueue, threading.Thread]:
    """Read the lines of a process's standard error in a thread; return their queue and the thread.

    Reading from a pipe has no timeout, reading from a queue has. The thread ends with the pipe: join it before the
    pipe is closed.
    """
    lines: LineQueue = queue.Queue()
    reader = threading.Thread(target=_read_lines, args=(process, lines), daemon=True)
    reader.start()
    return lines, reader


def _read_lines(process: "subprocess.Popen[str]", lines: LineQueue) -> None:
    if process.stderr is not None:
        for line in process.stderr:
            lines.put(line)
    lines.put(None)


def open_privately(path: Path) -> IO[bytes]:
    """Open a file for appending that only its owner can read, also if others could before."""
    file = os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600), "ab")
    os.fchmod(file.fileno(), 0o600)
    return file


def terminate(process: "subprocess.Popen[bytes]", timeout: float) -> None:
    """Ask a process to end, and kill it if it has not ended within a timeout [s]."""
    process.terminate()
    try:
        process.wait(timeout)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


@contextlib.contextmanager
def set_on_signals(stopping: threading.Event) -> Iterator[None]:
    """Set an event on Ctrl-C and SIGTERM for the duration of a block, instead of ending the process."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    before: dict[int, Any] = {number: signal.signal(number, lambda *_: stopping.set()) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)

"""Runs a command and kills it, with all processes that it started, when the parent process ends.

``python -P parent_watchdog.py COMMAND...``, with standard input held open by the parent. A killed parent cannot
stop its children, but the end of its pipe is detected on any system. Only the standard library is imported: every
command of a job starts a watchdog.
"""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from types import FrameType


def main(command: list[str]) -> int:
    """Run a command until it ends or standard input ends.

    Returns:
        Its exit status; 128 plus the signal's number if a signal ended it.
    """
    # In a separate process group, so that its own child processes can be killed with it.
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True)

    def end(number: int = 0, frame: FrameType | None = None) -> None:
        # The group has the number of its first process, which is invalid once `wait` below has returned.
        if process.returncode is None:
            os.killpg(process.pid, signal.SIGKILL)

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, end)
    threading.Thread(target=_watch_input, args=(end,), daemon=True).start()
    status = process.wait()
    return 128 - status if status < 0 else status


def _watch_input(act: Callable[[], None]) -> None:
    # Read from the descriptor: a buffered read would hold a lock that the interpreter needs when it exits.
    while os.read(0, 4096):
        pass
    act()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

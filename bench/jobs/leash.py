"""Runs a command that ends, with all that it has started, when the one who asked for it ends.

``python -m bench.jobs.leash COMMAND...`` with standard input held open by the holder. A holder that was killed
cannot stop what it has started; the end of its pipe is what it leaves behind on any system.
"""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from types import FrameType


def main(command: list[str]) -> int:
    """Run a command to its end, or to the end of standard input.

    Returns:
        Its exit status; 128 and the signal's number where a signal has ended it.
    """
    # A group of its own, so that whatever it starts can be ended with it.
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, start_new_session=True)

    def end(number: int = 0, frame: FrameType | None = None) -> None:
        # The group goes by the number of its first process, which `wait` below may have seen off already.
        if process.returncode is None:
            os.killpg(process.pid, signal.SIGKILL)

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, end)
    threading.Thread(target=_at_end_of_input, args=(end,), daemon=True).start()
    status = process.wait()
    return 128 - status if status < 0 else status


def _at_end_of_input(act: Callable[[], None]) -> None:
    # Straight from the descriptor: a buffered read would hold a lock that the interpreter wants at its end.
    while os.read(0, 4096):
        pass
    act()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

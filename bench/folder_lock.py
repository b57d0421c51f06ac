"""Lock of a data folder: one service, or one transfer of its catalogue, uses it at a time.

The operating system holds the lock, so that it is released when its process is killed.
"""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bench.processes import open_privately

LOCK_FILE = "service.lock"
"""File in a data folder that carries the lock; its content has no meaning."""


@contextmanager
def hold_lock(data: Path) -> Iterator[bool]:
    """Hold the lock of a data folder, and provide whether it was free.

    Args:
        data: data folder; it exists.

    Raises:
        OSError: the folder cannot be written to.
    """
    with open_privately(data / LOCK_FILE) as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            yield False
        else:
            yield True


def is_locked(data: Path) -> bool:
    """Return whether a process holds the lock of a data folder."""
    path = data / LOCK_FILE
    if not path.is_file():
        return False
    with path.open("rb") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError:
            return True
    return False

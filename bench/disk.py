"""Disk of the logs: free space, write protection, size of a run's log, refusal of a start, and a warning."""

import os
import shutil
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NamedTuple

from bench.errors import RunError

BYTES_PER_VALUE = 64.0
"""[byte] Size of one sample of one channel in a log, with its reading and its raw frame.

Logs of the simulated rig have 48, compressed; the rest is margin for noisier channels."""
RESERVE = 100_000_000
"""[byte] Space that a run leaves free, for the catalogue, fits, and the system itself."""
LOW_SPACE = 1_000_000_000
"""[byte] Free space below which a warning is shown; about an hour of recording."""
_IDLE_TIME = 10.0
"""[s] Time that a log contains beyond its programme: move to the first position, end of the run."""
_CHECK_PERIOD = 5.0
"""[s] Time between two checks of a `SpaceMonitor`."""
_GIGABYTE = 1e9


class FreeSpace(NamedTuple):
    """Free space of the disk that contains a folder."""

    folder: Path
    free: int
    """[byte]"""
    obstacle: str = ""
    """Reason why nothing can be written there; empty if it can."""


def find_free_space(folder: Path) -> FreeSpace:
    """Return the free space where a folder is, or will be created.

    Raises:
        RunError: the disk cannot be asked.
    """
    existing = next(one for one in (folder, *folder.absolute().parents) if one.exists())
    try:
        return FreeSpace(folder, shutil.disk_usage(existing).free, _find_obstacle(existing))
    except OSError as error:
        raise RunError(f"{existing}: the free space is not known ({error.strerror}); check the disk") from None


def find_usable_space(folder: Path) -> int | None:
    """Return the space for logs where a folder is, less the reserve [byte]; None if the disk cannot be asked."""
    try:
        return max(0, find_free_space(folder).free - RESERVE)
    except RunError:
        return None


def _find_obstacle(folder: Path) -> str:
    """Return the reason why nothing can be written to a folder; empty if it can."""
    if os.statvfs(folder).f_flag & os.ST_RDONLY:
        return f"{folder} is on a read-only file system; mount it for writing"
    if not os.access(folder, os.W_OK | os.X_OK):
        return f"{folder} cannot be written by this user; change its owner or its rights"
    return ""


def estimate_log_size(duration: float, rates: Iterable[float]) -> int:
    """Return the largest expected size of a run's log [byte].

    Args:
        duration: planned duration of the run [s].
        rates: rate of each recorded channel [Hz].
    """
    return round((duration + _IDLE_TIME) * sum(rates) * BYTES_PER_VALUE)


def check_space(space: FreeSpace, needed: int) -> None:
    """Check that a log can be written, fits on the disk, and leaves the reserve free.

    Args:
        space: free space.
        needed: size of the log [byte].

    Raises:
        RunError: it cannot be written, or does not fit.
    """
    if space.obstacle:
        raise RunError(f"{space.obstacle}, or choose another folder in bench.toml; nothing was started")
    if space.free < needed + RESERVE:
        raise RunError(
            f"the disk of {space.folder} has {_format(space.free)} free, but the log of this run needs up to "
            f"{_format(needed)} and {_format(RESERVE)} stay in reserve; nothing was started; free space, or "
            "choose another folder in bench.toml"
        )


def describe_low_space(space: FreeSpace) -> str:
    """Return a warning if nothing can be written or there is little space left, else an empty text."""
    if space.obstacle:
        return f"{space.obstacle}; no run can be recorded"
    if space.free >= LOW_SPACE:
        return ""
    return (
        f"the disk of {space.folder} has {_format(space.free)} free, less than {_format(LOW_SPACE)}; free space, "
        "because a run whose log may not fit is refused"
    )


def _format(size: int) -> str:
    return f"{size / _GIGABYTE:.3f} GB"


class SpaceMonitor:
    """Warning about the free space, checked at intervals, because a network disk may answer slowly.

    Args:
        folder: folder of the logs.
        clock: time [s].
    """

    def __init__(self, folder: Path, clock: Callable[[], float] = time.monotonic) -> None:
        self._folder, self._clock = folder, clock
        self._checked_at = float("-inf")
        self._warning = ""

    def describe(self) -> str:
        """Return the present warning, empty with enough space."""
        now = self._clock()
        if now - self._checked_at >= _CHECK_PERIOD:
            self._checked_at = now
            try:
                self._warning = describe_low_space(find_free_space(self._folder))
            except RunError as error:
                self._warning = str(error)
        return self._warning


def sync_path(path: Path) -> None:
    """Pass a file, or the names in a folder, to the disk.

    Raises:
        OSError: the disk refuses.
    """
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)

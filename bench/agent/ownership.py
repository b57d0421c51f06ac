"""Lock that admits one agent per bench."""

import contextlib
import fcntl
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from bench.errors import RunError


@contextlib.contextmanager
def acquire_agent_lock(config: Path) -> Iterator[None]:
    """Lock a bench for the duration of a block, or until the process ends.

    A second agent would find most wires free, because a CAN bus and Modbus TCP accept several hosts. By
    connecting, it would stop the drive and set the coil to zero in the middle of the first agent's run.

    Args:
        config: ``bench.toml`` of the bench.

    Raises:
        RunError: another process holds the lock.
    """
    with config.open("rb") as file:
        _lock_file(file)
        yield


def _lock_file(file: IO[bytes]) -> None:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise RunError(
            f"{file.name}: another rig agent has this bench; end it, or let it do the work (mrbench prepare, the "
            "page, or REST)"
        ) from None
    except OSError:  # a file system without locks, such as some network file systems: no protection there
        pass

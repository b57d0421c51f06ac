"""One agent a bench: whoever has it keeps others away from its wires."""

import contextlib
import fcntl
from collections.abc import Iterator
from pathlib import Path

from bench.errors import RunError


@contextlib.contextmanager
def sole_agent(config: Path) -> Iterator[None]:
    """Have a bench for oneself, as long as the block lasts or the process lives.

    A second agent would find most wires free: a CAN bus and Modbus TCP take several hosts, and to connect there
    means to stop the drive and to bring the coil to zero in the middle of the first one's run.

    Args:
        config: ``bench.toml`` of the bench.

    Raises:
        RunError: another process has it.
    """
    with config.open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise RunError(
                f"{config}: another rig agent has this bench; end it, or let it do the work (mrbench prepare, the "
                "page, or REST)"
            ) from None
        except OSError:  # a file system without locks, such as some of networks: then nobody can be kept away
            pass
        yield

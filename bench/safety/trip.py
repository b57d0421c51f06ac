"""Brings coil and actuator to rest, each in its own thread: neither waits for the other.

What is done here is the faster way, never the only one. The drive stops by itself when setpoints or heartbeat go,
the amplifier ramps down by itself when nobody speaks; and the emergency stop is a chain of hardware.
"""

import threading
import time
from collections.abc import Callable
from typing import NamedTuple, Protocol

from drivers.errors import DriverError

DEADLINE = 1.0
"""[s] within which both have to be at rest."""


class Stoppable(Protocol):
    """What can be brought to rest."""

    @property
    def name(self) -> str:
        """Of the instrument."""

    def make_safe(self) -> None:
        """Bring it to rest by its own safest way."""


class Rest(NamedTuple):
    """What came of it."""

    seconds: dict[str, float]
    """[s] until each said that it was done, by name; missing where it did not."""
    failures: dict[str, str]
    """What went wrong, by name."""

    def __str__(self) -> str:
        """For a person."""
        done = [f"{name} after {seconds * 1e3:.0f} ms" for name, seconds in self.seconds.items()]
        return "; ".join([*done, *(f"{name}: {why}" for name, why in self.failures.items())])


def bring_to_rest(
    instruments: list[Stoppable], within: float = DEADLINE, clock: Callable[[], float] = time.monotonic
) -> Rest:
    """Make all of them safe at the same time; returns when all have, or when the time is over.

    Args:
        instruments: each is called in a thread of its own.
        within: [s] deadline for all of them together.
        clock: [s] for how long each took.
    """
    begin = clock()
    seconds: dict[str, float] = {}
    failures: dict[str, str] = {}

    def stop(one: Stoppable) -> None:
        try:
            one.make_safe()
            seconds[one.name] = clock() - begin
        except DriverError as error:
            failures[one.name] = str(error)
        except Exception as error:  # what is not told here would read as if it had come to rest
            failures[one.name] = f"{error!r}; this is a defect of the driver"

    threads = {one.name: threading.Thread(target=stop, args=(one,), daemon=True) for one in instruments}
    for thread in threads.values():
        thread.start()
    for name, thread in threads.items():
        thread.join(max(0.0, begin + within - clock()))
        if thread.is_alive():
            failures[name] = f"waited {within:g} s for it to come to rest; its own watchdog has to"
    # Copies: a thread that was given up may write into the others still.
    return Rest(dict(seconds), dict(failures))

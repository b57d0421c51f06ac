"""Simultaneous stop of several instruments, each in a thread of its own with a common deadline.

This is the fast way to a safe state, but not the only one. The drive stops by itself without setpoints or
heartbeat, the amplifier ramps down by itself without requests, and the emergency stop is a hardware chain.
"""

import threading
import time
from collections.abc import Callable
from typing import NamedTuple, Protocol

from drivers import DriverError

STOP_DEADLINE = 1.0
"""[s] Time within which all instruments have to be at rest."""


class StoppableInstrument(Protocol):
    """Instrument that can be stopped."""

    @property
    def name(self) -> str:
        """Name in configuration and logs."""

    def make_safe(self) -> str:
        """Stop by the instrument's safest procedure; return why its rest is not confirmed, or an empty text."""


class StopResult(NamedTuple):
    """Result of a stop, by the names of the instruments."""

    seconds: dict[str, float]
    """[s] Time until each instrument confirmed that it is at rest; missing if it did not."""
    failures: dict[str, str]
    """Reason why an instrument did not confirm that it is at rest."""

    def __str__(self) -> str:
        """Return in one line what each instrument has confirmed."""
        confirmed = [f"{name}: rest confirmed after {1e3 * time:.0f} ms" for name, time in self.seconds.items()]
        unconfirmed = [f"{name}: rest not confirmed: {reason}" for name, reason in self.failures.items()]
        return "; ".join([*confirmed, *unconfirmed])


def bring_to_rest(
    instruments: list[StoppableInstrument],
    timeout: float = STOP_DEADLINE,
    clock: Callable[[], float] = time.monotonic,
) -> StopResult:
    """Stop all instruments at the same time; return when all are done or the timeout has passed.

    Args:
        instruments: each is stopped in a thread of its own.
        timeout: [s] for all instruments together.
        clock: [s] by which the stop times are measured.
    """
    begin = clock()
    seconds: dict[str, float] = {}
    failures: dict[str, str] = {}

    def stop(instrument: StoppableInstrument) -> None:
        try:
            reason = instrument.make_safe()
            if reason:
                failures[instrument.name] = reason
            else:
                seconds[instrument.name] = clock() - begin
        except DriverError as error:
            failures[instrument.name] = str(error)
        except Exception as error:  # an unreported failure would look like an instrument at rest
            failures[instrument.name] = f"{error!r}; internal error of the driver, please report"

    # One thread each, so that an instrument that does not reply delays no other.
    threads = {one.name: threading.Thread(target=stop, args=(one,), daemon=True) for one in instruments}
    for thread in threads.values():
        thread.start()
    for name, thread in threads.items():
        thread.join(max(0.0, begin + timeout - clock()))
        if thread.is_alive():
            failures[name] = f"no answer within {timeout:g} s; its own watchdog has to stop it"
    # Copies, because an abandoned thread may still write to the originals.
    return StopResult(dict(seconds), dict(failures))

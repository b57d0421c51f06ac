"""One thread a wire: asks its instrument for samples again and again, and its clock beside the bench's.

Nothing that blocks on anything but the wire runs here. A driver's error is told once; a failed instrument is left
alone, or connected again with growing pauses where that is allowed.
"""

import contextlib
import threading
import time
from collections.abc import Callable, Mapping
from typing import NamedTuple, Protocol

from bench.rig.clock_map import ClockMap
from bench.rig.priority import raise_priority
from drivers.channel import Block, Stamp
from drivers.errors import DriverError
from drivers.instrument import Instrument

PATIENCE = 0.1
"""[s] that an instrument is waited for in one turn; stopping takes no longer, but for a wire that hangs."""
IDLE_PERIOD = 0.05
"""[s] between two samples of an instrument that must be asked for each, while nobody leads it."""
FIRST_PAUSE, LONGEST_PAUSE = 0.5, 10.0
"""[s] before connecting again: at first, and at most."""
STOP_WITHIN = 3.0
"""[s] for all threads to end."""


class Batch(NamedTuple):
    """What one instrument brought in one turn."""

    instrument: str
    blocks: tuple[Block, ...]


class Sampled(Protocol):
    """An instrument that gives a sample only when it is asked for one, as a drive does at each SYNC."""

    def sample(self) -> None:
        """Ask for one."""


class Acquisition:
    """Threads around connected instruments."""

    def __init__(
        self,
        instruments: Mapping[str, Instrument],
        sink: Callable[[Batch], None],
        failed: Callable[[str, DriverError], None],
        *,
        idle: Mapping[str, Sampled] | None = None,
    ) -> None:
        """Nothing is read yet.

        Args:
            instruments: by name, connected.
            sink: takes each batch, on the thread of its wire; must not block.
            failed: told once that an instrument has failed, on its thread, with its name and why.
            idle: by name, those that are to be asked for samples while nobody leads them.
        """
        self.maps = {name: ClockMap() for name in instruments}
        """Each instrument's clock on the bench's; those without a clock stay unknown."""
        self.reconnect = False
        """Whether a failed instrument is connected again."""
        self.led = False
        """While true, somebody else asks those of ``idle`` for samples. Set it before a table is armed that the
        next SYNC starts."""
        self._warnings: dict[str, str] = {}
        self._stopping = threading.Event()
        idle = idle or {}
        self._wires = [_Wire(name, made, idle.get(name), self, sink, failed) for name, made in instruments.items()]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the system did not grant, each sentence once."""
        return tuple(dict.fromkeys(filter(None, self._warnings.values())))

    @property
    def down(self) -> tuple[str, ...]:
        """Names of the instruments that have failed and are not back."""
        return tuple(wire.name for wire in self._wires if wire.down)

    @property
    def reconnected(self) -> dict[str, int]:
        """Times that each instrument was connected again."""
        return {wire.name: wire.reconnected for wire in self._wires}

    def start(self) -> None:
        """Read from now on."""
        for wire in self._wires:
            wire.thread.start()

    def stop(self, within: float = STOP_WITHIN) -> tuple[str, ...]:
        """Stop reading; harmless when repeated.

        Args:
            within: deadline for all threads together [s].

        Returns:
            Names of the instruments whose wires hang; their threads end with the process.
        """
        self._stopping.set()
        deadline = time.monotonic() + within
        return tuple(wire.name for wire in self._wires if not wire.ended(deadline))

    def warn(self, wire: str, sentence: str) -> None:
        """Take note of what a thread was not granted."""
        self._warnings[wire] = sentence

    @property
    def stopping(self) -> bool:
        """Whether the threads are to end."""
        return self._stopping.is_set()

    def wait(self, seconds: float) -> bool:
        """Wait [s]; whether the threads are to end."""
        return self._stopping.wait(seconds)


class _Wire:
    """One instrument and its thread."""

    def __init__(
        self,
        name: str,
        instrument: Instrument,
        idle: Sampled | None,
        owner: Acquisition,
        sink: Callable[[Batch], None],
        failed: Callable[[str, DriverError], None],
    ) -> None:
        self.name = name
        self.down = False
        self.reconnected = 0
        self.thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._instrument, self._idle, self._owner = instrument, idle, owner
        self._sink, self._failed = sink, failed
        self._due = 0.0
        self._stamp: Stamp | None = None

    def ended(self, deadline: float) -> bool:
        """Whether the thread has ended by the deadline, on the monotonic clock [s]."""
        if self.thread.is_alive():
            self.thread.join(max(deadline - time.monotonic(), 0.0))
        return not self.thread.is_alive()

    def _run(self) -> None:
        self._owner.warn(self.name, raise_priority())
        while not self._owner.stopping:
            try:
                self._turn()
            except DriverError as error:
                self._recover(error)
            except Exception as error:  # a thread that dies in silence would look like an instrument at rest
                self._recover(
                    DriverError(f"{self.name}: cannot be read: {error!r}; this is a defect of the driver")
                )

    def _turn(self) -> None:
        blocks = self._instrument.acquire(self._patience())
        # The clock before the samples: whoever takes them asks at once when they were made.
        stamp = getattr(self._instrument, "stamp", None)
        if stamp is not None and stamp is not self._stamp:
            self._stamp = stamp
            self._owner.maps[self.name].feed(stamp)
        if blocks:
            newest = blocks[-1]
            if newest.device_ns is not None:
                self._owner.maps[self.name].feed_sample(int(newest.device_ns[-1]), newest.received_ns)
            self._sink(Batch(self.name, tuple(blocks)))

    def _patience(self) -> float:
        """How long to wait in this turn [s]; asks for a sample first where nobody else does."""
        if self._idle is None or self._owner.led:
            return PATIENCE
        now = time.monotonic()
        if now >= self._due:
            self._idle.sample()
            self._due = now + IDLE_PERIOD
        return self._due - now

    def _recover(self, error: DriverError) -> None:
        """Tell of the error, and come back once the instrument is connected again, or never."""
        self.down = True
        self._failed(self.name, error)
        pause = FIRST_PAUSE
        while not self._owner.wait(pause):
            if not self._owner.reconnect:
                continue
            if self._connected():
                self.down = False
                self.reconnected += 1
                return
            pause = min(2 * pause, LONGEST_PAUSE)

    def _connected(self) -> bool:
        # Why it failed has been told; whatever keeps it from coming back must not end the thread that tries.
        with contextlib.suppress(Exception):
            self._instrument.close()
            self._instrument.connect()
            self._owner.maps[self.name].restart()
            return True
        return False

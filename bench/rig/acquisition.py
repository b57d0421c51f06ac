"""Acquisition: one thread per wire reads the samples of its instrument and its clock.

These threads block on nothing but their wire. An error of a driver is reported once. The failed instrument is then
connected again at growing intervals, or left alone while reconnection is suspended.
"""

import contextlib
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple, Protocol, runtime_checkable

from bench.rig.clock_map import ClockMap
from bench.rig.priority import raise_priority
from drivers import ClockReading, DriverError, Instrument, SampleBlock

ACQUIRE_TIMEOUT = 0.1
"""[s] Longest wait for samples in one turn, and so the time that stopping takes unless a wire hangs."""
IDLE_PERIOD = 0.05
"""[s] Interval of requests to a polled instrument while no setpoint thread triggers it."""
STOP_TIMEOUT = 3.0
"""[s] Time for all threads to end."""


class Batch(NamedTuple):
    """Sample blocks that one instrument delivered in one turn."""

    instrument: str
    blocks: tuple[SampleBlock, ...]


BatchSink = Callable[[Batch], None]
FailureSink = Callable[[str, DriverError], None]


class RetryPauses(NamedTuple):
    """Pauses before a failed instrument is connected again; each is twice the one before."""

    first: float = 0.5
    """First pause [s]."""
    longest: float = 10.0
    """Longest pause [s]."""


RETRY_PAUSES = RetryPauses()
"""Pauses in operation."""


class PolledInstrument(Protocol):
    """Instrument that takes a sample only on request, as a drive does at each SYNC."""

    def send_sync(self) -> None:
        """Request one sample."""


@runtime_checkable
class ClockedInstrument(Protocol):
    """Instrument whose clock is read together with the bench clock."""

    @property
    def clock_reading(self) -> ClockReading | None:
        """Latest reading of its clock; None before the first."""


class _Controls:
    """Switches that an acquisition shares with its threads."""

    def __init__(self) -> None:
        self.stopping = threading.Event()
        self.may_reconnect = threading.Event()
        self.externally_triggered = threading.Event()


class Acquisition:
    """Acquisition threads of all instruments."""

    def __init__(
        self,
        instruments: Mapping[str, Instrument],
        on_batch: BatchSink,
        on_failed: FailureSink,
        *,
        idle: Mapping[str, PolledInstrument] | None = None,
        retry_pauses: RetryPauses = RETRY_PAUSES,
    ) -> None:
        """Create the threads; `start` begins to read.

        Args:
            instruments: connected instruments by name.
            on_batch: receives each batch on the thread of its wire; must not block.
            on_failed: receives name and error of a failed instrument once, on the thread of its wire.
            idle: polled instruments by name, which are asked for samples while they are not externally triggered.
            retry_pauses: pauses before a failed instrument is connected again.
        """
        self.maps = {name: ClockMap() for name in instruments}
        """Clock map of each instrument; unknown for instruments without a clock."""
        self._controls = _Controls()
        idle = idle or {}
        self._threads = [
            _AcquisitionThread(
                name,
                instrument,
                idle.get(name),
                self.maps[name],
                self._controls,
                on_batch,
                on_failed,
                retry_pauses,
            )
            for name, instrument in instruments.items()
        ]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Privileges that the system did not grant to the threads, each sentence once."""
        return tuple(dict.fromkeys(wire.warning for wire in self._threads if wire.warning))

    @property
    def failed_instruments(self) -> tuple[str, ...]:
        """Names of the instruments that have failed and are not connected again."""
        return tuple(wire.name for wire in self._threads if wire.has_failed)

    @property
    def reconnect_counts(self) -> dict[str, int]:
        """Number of times that each instrument was connected again."""
        return {wire.name: wire.reconnect_count for wire in self._threads}

    def enable_reconnection(self) -> None:
        """Connect failed instruments again from now on."""
        self._controls.may_reconnect.set()

    @contextlib.contextmanager
    def suspend_reconnection(self) -> Iterator[None]:
        """Leave failed instruments alone for the duration of a block."""
        was_enabled = self._controls.may_reconnect.is_set()
        self._controls.may_reconnect.clear()
        try:
            yield
        finally:
            if was_enabled:
                self._controls.may_reconnect.set()

    def set_externally_triggered(self, triggered: bool) -> None:
        """Set whether the setpoint thread's SYNCs request the samples of polled instruments.

        Call it before a drive table is armed, because any SYNC would start the table.
        """
        if triggered:
            self._controls.externally_triggered.set()
        else:
            self._controls.externally_triggered.clear()

    def start(self) -> None:
        """Begin to read all instruments."""
        for wire in self._threads:
            wire.thread.start()

    def stop(self, timeout: float = STOP_TIMEOUT) -> tuple[str, ...]:
        """Stop reading; harmless if repeated.

        Args:
            timeout: [s] for all threads together.

        Returns:
            Names of the instruments whose wires hang; their threads end with the process.
        """
        self._controls.stopping.set()
        deadline = time.monotonic() + timeout
        return tuple(wire.name for wire in self._threads if not wire.join(deadline))


class _AcquisitionThread:
    """Thread that reads one instrument."""

    def __init__(
        self,
        name: str,
        instrument: Instrument,
        idle: PolledInstrument | None,
        clock_map: ClockMap,
        controls: _Controls,
        on_batch: BatchSink,
        on_failed: FailureSink,
        retry_pauses: RetryPauses,
    ) -> None:
        self.name = name
        self.has_failed = False
        self.reconnect_count = 0
        self.warning = ""
        self.thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._instrument, self._idle = instrument, idle
        self._clocked = instrument if isinstance(instrument, ClockedInstrument) else None
        self._clock_map, self._controls = clock_map, controls
        self._on_batch, self._on_failed, self._retry_pauses = on_batch, on_failed, retry_pauses
        self._next_request = 0.0
        self._last_reading: ClockReading | None = None

    def join(self, deadline: float) -> bool:
        """Return whether the thread has ended by a deadline on the monotonic clock [s]."""
        if self.thread.is_alive():
            self.thread.join(max(deadline - time.monotonic(), 0.0))
        return not self.thread.is_alive()

    def _run(self) -> None:
        self.warning = raise_priority()
        while not self._controls.stopping.is_set():
            try:
                self._acquire()
            except DriverError as error:
                self._recover(error)
            except Exception as error:  # a thread that ended silently would look like an instrument at rest
                self._recover(
                    DriverError(
                        f"{self.name}: cannot be read: {error!r}; internal error of the driver, please report"
                    )
                )

    def _acquire(self) -> None:
        blocks = self._instrument.acquire(self._request_idle_sample())
        # The clock before the samples, because their receivers convert the sample times at once.
        self._add_clock_reading()
        if blocks:
            newest = blocks[-1]
            if newest.device_ns is not None:
                self._clock_map.add_sample(int(newest.device_ns[-1]), newest.received_ns)
            self._on_batch(Batch(self.name, tuple(blocks)))

    def _add_clock_reading(self) -> None:
        reading = None if self._clocked is None else self._clocked.clock_reading
        if reading is not None and reading is not self._last_reading:
            self._last_reading = reading
            self._clock_map.add_reading(reading)

    def _request_idle_sample(self) -> float:
        """Request a sample if nothing else triggers it and one is due; return the timeout of this turn [s]."""
        if self._idle is None or self._controls.externally_triggered.is_set():
            return ACQUIRE_TIMEOUT
        now = time.monotonic()
        if now >= self._next_request:
            self._idle.send_sync()
            self._next_request = now + IDLE_PERIOD
        return self._next_request - now

    def _recover(self, error: DriverError) -> None:
        """Report an error, and return once the instrument is connected again or the acquisition stops."""
        self.has_failed = True
        self._on_failed(self.name, error)
        pause = self._retry_pauses.first
        while not self._controls.stopping.wait(pause):
            if not self._controls.may_reconnect.is_set():
                continue
            if self._try_reconnect():
                self.has_failed = False
                self.reconnect_count += 1
                return
            pause = min(2 * pause, self._retry_pauses.longest)

    def _try_reconnect(self) -> bool:
        # The failure was reported, and no further error may end the thread.
        with contextlib.suppress(Exception):
            self._instrument.close()
            self._instrument.connect()
            # The instrument may have restarted, and its clock with it.
            self._clock_map.restart()
            return True
        return False

"""Interface of all instruments: a few typed channels and a few methods, the same on every wire.

The agent runs one thread per wire, which calls `Instrument.acquire` repeatedly. Times refer to the bench clock,
which is passed in as a function, so that a test can step it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from drivers.channel import Channel, Frame, Reading, SampleBlock

Clock = Callable[[], int]
"""Bench clock [ns], monotonic."""
FrameListener = Callable[[Frame], None]
"""Function that is called with every frame sent and received."""


@dataclass(frozen=True)
class Health:
    """Counts since an instrument was connected, and its state."""

    connected: bool
    received: int
    """Frames or replies received."""
    lost: int
    """Samples that were taken by the instrument, as their sequence shows, but never arrived."""
    corrupted: int
    """Frames with a wrong checksum or format. None of their content was used."""
    resynchronised: int
    """Times that the start of a frame had to be searched for."""
    last_ns: int | None
    """Bench clock at the last good frame [ns]."""
    message: str
    """Description of the present problems; empty without a problem."""


class Instrument(Protocol):
    """One instrument on its wire."""

    @property
    def name(self) -> str:
        """Name in configuration, logs and messages."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Channels that it measures and sets."""

    def connect(self) -> None:
        """Open the wire, check the instrument's identity and bring it to a known state.

        Raises:
            NotConnectedError: the wire cannot be opened.
            NoReplyError, InvalidReplyError, RefusedError: the expected instrument does not reply.
        """

    def close(self) -> None:
        """Leave the instrument safe and close the wire. May be repeated, and called without `connect`."""

    def acquire(self, timeout: float) -> list[SampleBlock]:
        """Return the samples since the last call, waiting up to ``timeout`` [s] for the first; empty if none.

        Some milliseconds of samples are read together, so the call may take that much longer (`drivers.polling`).

        Raises:
            NotConnectedError: the wire is gone, or a polled instrument has not replied for a second or has
                restarted. An instrument that sends unrequested and falls silent raises nothing: its silence shows
                in `get_health`, and the interlocks check the age of its latest sample.
            NoReplyError: the wire is there, but the instrument's heartbeat is not.
        """

    def read(self, channel: str) -> Reading:
        """Request one value now."""

    def write(self, channel: str, value: float) -> None:
        """Set one value, in the channel's unit.

        Raises:
            OutOfRangeError: nothing was sent.
        """

    def make_safe(self) -> str:
        """Bring the instrument to rest within its own deadline. Raises nothing, even if the wire is gone.

        Returns:
            The reason why the instrument did not confirm its rest; empty if it did.
        """

    def get_health(self) -> Health:
        """Return counts and state."""

    def add_listener(self, listener: FrameListener) -> None:
        """Call ``listener`` with every frame from now on."""

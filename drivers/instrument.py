"""What every instrument can do, whatever its wire.

An instrument is a handful of typed channels and a few verbs. A driver is one file that turns them into its
protocol; the agent runs one thread a wire that calls ``acquire`` again and again. Time is the bench clock, handed
in as a function, so that a test can step it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from drivers.channel import Block, Channel, Frame, Reading

Clock = Callable[[], int]
"""The bench clock [ns], monotonic."""
Tap = Callable[[Frame], None]
"""Told of every frame, received and sent."""


@dataclass(frozen=True)
class Health:
    """What an instrument's wire has been through since it was connected."""

    connected: bool
    received: int
    """Frames or replies taken."""
    lost: int
    """Samples that the sequence says were made but never came."""
    corrupted: int
    """Frames whose checksum or form was wrong; none of their content was used."""
    resynchronised: int
    """Times that the stream had to be found again."""
    last_ns: int | None
    """Bench clock of the last good frame [ns]."""
    words: str
    """State for a person, empty where all is well."""


class Instrument(Protocol):
    """One instrument on its wire."""

    @property
    def name(self) -> str:
        """Name in configuration, logs and messages."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """What it measures and takes."""

    def connect(self) -> None:
        """Open the wire, check who answers, bring it to a known state.

        Raises:
            NotConnected: the wire cannot be opened.
            NoReply, BadReply, Refused: it opens, but the instrument does not answer as itself.
        """

    def close(self) -> None:
        """Leave the instrument safe and the wire closed; harmless when repeated or when never connected."""

    def acquire(self, timeout: float) -> list[Block]:
        """Samples that came since the last call, waiting up to ``timeout`` [s] for the first; empty if none.

        Some milliseconds of samples are taken together, so that it may last so much longer (`drivers.beat`).

        Raises:
            NotConnected: the wire has gone, an instrument that is asked has not answered for a second, or it has
                started anew and must be connected again. One that speaks unasked and falls silent raises nothing:
                its silence shows in `health`, and the interlocks judge the age of what came last.
            NoReply: it is there no more, though its wire is: no heartbeat.
        """

    def read(self, channel: str) -> Reading:
        """Ask for one value now."""

    def write(self, channel: str, value: float) -> None:
        """Set one value, in the channel's unit.

        Raises:
            OutOfRange: nothing was sent.
        """

    def make_safe(self) -> None:
        """Bring it to rest by its own safest way, within its own deadline; never raises for a dead wire."""

    def health(self) -> Health:
        """Counts and state."""

    def listen(self, tap: Tap) -> None:
        """Tell ``tap`` of every frame from now on."""

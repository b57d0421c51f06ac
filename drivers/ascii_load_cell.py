"""Load cell on a plain weighing indicator: one line of text a reading, such as ``ST,GS,+0012.34 kg``.

There is no checksum, no sequence and no clock. What can be checked is: the form of the line, character by
character, the range, and whether a reading agrees with the one before. The rest is luck, so the quality of every
reading is ``uncertain``, and times are those of the bench when the line ended.
"""

import threading
import time
from typing import Any, Final

from drivers.ascii_load_cell_stream import CONTRACT, FULL_SCALE, ReadingStream
from drivers.channel import Block, Channel, Reading
from drivers.errors import NoReply, OutOfRange
from drivers.instrument import Clock, Health, Tap
from drivers.serial_line import SerialLine

_LIMITS = CONTRACT["limits"]


class AsciiLoadCell:
    """A weighing indicator that sends its readings unasked."""

    def __init__(
        self,
        name: str,
        port: str,
        clock: Clock,
        *,
        baud: int | None = None,
        wild_step: float = _LIMITS["wild_step_n"],
    ) -> None:
        """An indicator that is not connected yet.

        Args:
            name: in configuration, logs and messages.
            port: ``/dev/tty*``, ``socket://host:port`` or ``rfc2217://host:port``.
            clock: the bench clock [ns].
            baud: [bit/s]; that of the contract if none.
            wild_step: how far a reading may lie from the one before to be believed at once [N].
        """
        self.name: Final = name
        self.channels: Final = (
            Channel("force", "N", -FULL_SCALE, FULL_SCALE, "read", "axial force as the indicator shows it"),
            Channel("force_raw", "N", -FULL_SCALE, FULL_SCALE, "read", "the same while it shows gross"),
        )
        self._clock = clock
        self._line = SerialLine(name, port, baud or CONTRACT["line"]["baud"], clock)
        self._stream = ReadingStream(wild_step)
        self._before = (0, 0, 0, 0)
        self._pending: list[Block] = []
        self._reading = threading.RLock()

    def connect(self) -> None:
        """Open the line and wait for two readings that agree.

        Raises:
            NotConnected: the line cannot be opened.
            NoReply: no reading came in time.
        """
        self._line.open()
        self._pending, self._before = [], self._counts()
        if not self._waited(2 * _LIMITS["silence_s"]):
            refused = self._stream.corrupted - self._before[2]
            self._line.close()
            raise NoReply(
                f"{self.name}: no reading within {2 * _LIMITS['silence_s']:.3g} s, {refused} lines refused; "
                "check that the indicator sends continuously, its line format and its baud rate"
            )

    def close(self) -> None:
        """Close the line; harmless when repeated or when never connected."""
        self._line.close()

    def acquire(self, timeout: float) -> list[Block]:
        """Readings that came since the last call, waiting up to ``timeout`` [s] for the first; empty if none.

        Raises:
            NotConnected: the line has gone, or was never opened.
        """
        with self._reading:
            self._waited(timeout)
            taken, self._pending = self._pending, []
        return taken

    def read(self, channel: str) -> Reading:
        """The next reading of a channel; `acquire` still hands it out.

        Raises:
            NoReply: none came in time.
            OutOfRange: there is no such channel.
        """
        self._known(channel)
        with self._reading:
            # Put aside: only a reading from now on answers, and `acquire` wants all of them in their order.
            held, self._pending = self._pending, []
            try:
                self._waited(_LIMITS["silence_s"])
                block = next((block for block in self._pending if block.channel == channel), None)
            finally:
                self._pending = held + self._pending
        if block is None:
            raise NoReply(
                f"{self.name}: no reading of {channel} within {_LIMITS['silence_s']:.3g} s; check that the "
                "indicator sends, and shows gross where the untared force is wanted"
            )
        return Reading(float(block.values[-1]), block.received_ns, None, float(block.raw[-1]), block.quality)

    def write(self, channel: str, value: float) -> None:
        """Refuse: an indicator takes no values.

        Raises:
            OutOfRange: always.
        """
        self._known(channel)
        raise OutOfRange(f"{self.name}: {channel} is measured, never set to {value:.6g} N; nothing was sent")

    def describe(self) -> dict[str, Any]:
        """What a replay needs beside the frames from now on, see `drivers.replay`."""
        with self._reading:
            return {"decoder": "ascii_load_cell", "state": self._stream.state()}

    def make_safe(self) -> None:
        """Nothing: it moves nothing."""

    def health(self) -> Health:
        """Counts since it was connected; readings that showed an overload are lost."""
        received, lost, corrupted, again = (
            now - then for now, then in zip(self._counts(), self._before, strict=True)
        )
        return Health(self._line.is_open, received, lost, corrupted, again, self._stream.last_ns, self._words())

    def listen(self, tap: Tap) -> None:
        """Tell ``tap`` of all bytes from now on; a `ReadingStream` given them makes the same blocks."""
        self._line.listen(tap)

    def _counts(self) -> tuple[int, int, int, int]:
        stream = self._stream
        return stream.received, stream.overloaded, stream.corrupted, stream.resynchronised

    def _words(self) -> str:
        if not self._line.is_open:
            return "not connected"
        if self._stream.overload:
            return "overload"
        silent = (self._clock() - (self._stream.last_ns or 0)) * 1e-9
        return f"silent for {silent:.3g} s" if silent > _LIMITS["silence_s"] else ""

    def _known(self, channel: str) -> None:
        names = [known.name for known in self.channels]
        if channel not in names:
            raise OutOfRange(f"{self.name}: no channel {channel!r}, only {', '.join(names)}; nothing was sent")

    def _waited(self, timeout: float) -> bool:
        """Read until there are blocks, or the time [s] is over."""
        deadline = time.monotonic() + timeout
        while True:
            left = deadline - time.monotonic()
            frame = self._line.read(0.0 if self._pending else max(left, 0.0))
            if frame is not None:
                self._pending += self._stream.feed(frame.received_ns, frame.data)
            if self._pending or left <= 0:
                return bool(self._pending)

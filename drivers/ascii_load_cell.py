"""Load cell on a plain weighing indicator: one line of text a reading, such as ``ST,GS,+0012.34 kg``.

There is no checksum, no sequence and no clock. What can be checked is: the form of the line, character by
character, the range, and whether a reading agrees with the one before. The rest is luck, so the quality of every
reading is ``uncertain``, and times are those of the bench when the line ended.
"""

import re
import threading
import time
import tomllib
from collections.abc import Iterator, Mapping
from itertools import groupby
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from drivers.channel import Block, Channel, Reading
from drivers.errors import NoReply, OutOfRange
from drivers.instrument import Clock, Health, Tap
from drivers.serial_line import SerialLine

CONTRACT: dict[str, Any] = tomllib.loads(
    (Path(__file__).parent / "wire" / "ascii_load_cell.toml").read_text("utf-8")
)
"""``wire/ascii_load_cell.toml``, which says how a line is laid out."""

_FORM, _STATE, _ZERO = CONTRACT["reading"], CONTRACT["state"], CONTRACT["zero"]
_NEWTONS: dict[str, float] = CONTRACT["units"]
_FULL_SCALE: float = CONTRACT["instrument"]["full_scale_n"]
_LIMITS = CONTRACT["limits"]
_LINE = re.compile(
    rf"({_STATE['stable']}|{_STATE['moving']}),({_ZERO['gross']}|{_ZERO['net']}),"
    rf"([+-])(?=.{{{_FORM['value_width'] - 1}}}\d ) *(\d+(?:\.\d+)?) +({'|'.join(_NEWTONS)})"
)


class Line(NamedTuple):
    """One reading, as on the wire."""

    number: int
    """Of the line, those refused included."""
    shown: float
    """In the indicator's unit."""
    newtons: float
    """[N]"""
    net: bool
    """Whether the indicator's tare has been taken off."""


class ReadingStream:
    """Stamped bytes in, blocks of readings out; pure, so that a replay gives the same blocks bit for bit.

    A line that is refused takes a number all the same: it was a reading, most likely.
    """

    def __init__(self, wild_step: float = _LIMITS["wild_step_n"]) -> None:
        """An empty stream; ``wild_step`` [N] is how far a reading may lie from the one before to be believed."""
        self.received = 0
        """Lines taken."""
        self.corrupted = 0
        """Lines refused: cut, garbled, out of range, wild."""
        self.overloaded = 0
        """Lines that show an overload in place of a value."""
        self.resynchronised = 0
        """Lines taken behind refused ones."""
        self.last_ns: int | None = None
        """Bench clock of the last line taken [ns]."""
        self.overload = False
        """Whether the last line shows one."""
        self._wild_step = wild_step
        self._buffer = b""
        self._fed_ns = 0
        self._number = -1
        self._before: float | None = None
        self._accepted: float | None = None
        self._astray = False

    def feed(self, received_ns: int, data: bytes) -> list[Block]:
        """Blocks of the readings that are complete with ``data``.

        Args:
            received_ns: bench clock of the last byte [ns]; a piece of line older than a line lasts is dropped.
            data: as it came from the line, cut anywhere.
        """
        if self._buffer and received_ns - self._fed_ns > _LIMITS["line_s"] * 1e9:
            self._refused(counted=True)
            self._buffer = b""
        self._fed_ns = received_ns
        self._buffer += data
        lines = list(self._complete())
        if lines:
            self.last_ns = received_ns
        return list(_blocks(lines, received_ns))

    def state(self) -> dict[str, Any]:
        """Where it stands: what `resume` needs to go on with the bytes after ``at_ns`` as this one does."""
        return {
            "at_ns": self._fed_ns, "buffer": self._buffer.hex(), "number": self._number, "before": self._before,
            "accepted": self._accepted, "astray": self._astray, "wild_step": self._wild_step,
        }  # fmt: skip

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on from a `state`."""
        self._fed_ns, self._buffer, self._number = state["at_ns"], bytes.fromhex(state["buffer"]), state["number"]
        self._before, self._accepted = state["before"], state["accepted"]
        self._astray, self._wild_step = state["astray"], state["wild_step"]

    def _complete(self) -> Iterator[Line]:
        *ended, rest = re.split(rb"[\r\n]+", self._buffer)
        for text in ended:
            if text and (line := self._read(text.decode("ascii", "replace"))) is not None:
                yield line
        overlong = len(rest) > _LIMITS["longest_line"]
        self._buffer = rest[-_LIMITS["longest_line"] :] if overlong else rest

    def _read(self, text: str) -> Line | None:
        self._number += 1
        self.overload = text.startswith(_STATE["overload"] + ",") and len(text) == _FORM["length"]
        if self.overload:
            self.overloaded += 1
            return None
        match = _LINE.fullmatch(text) if len(text) == _FORM["length"] else None
        if match is None:
            self._refused(counted=self._number > 0)
            return None
        _, zero, sign, digits, unit = match.groups()
        shown = float(sign + digits)
        newtons = shown * _NEWTONS[unit]
        doubt, self._before = self._doubt(newtons), newtons
        if doubt:
            self._refused(counted=self._accepted is not None or abs(newtons) > _FULL_SCALE)
            return None
        self.received += 1
        self.resynchronised += self._astray
        self._accepted, self._astray = newtons, False
        return Line(self._number, shown, newtons, zero == _ZERO["net"])

    def _doubt(self, newtons: float) -> bool:
        """Whether neither the line before nor the last one taken agrees; the first of all has no witness."""
        witnesses = [seen for seen in (self._before, self._accepted) if seen is not None]
        agrees = any(abs(newtons - seen) <= self._wild_step for seen in witnesses)
        return not agrees or abs(newtons) > _FULL_SCALE

    def _refused(self, counted: bool) -> None:
        """The first line of all is cut or without witness as a rule, and no reason for alarm."""
        self.corrupted += counted
        self._astray |= counted


def _blocks(lines: list[Line], received_ns: int) -> Iterator[Block]:
    """Blocks without gap; the untared force only where the indicator shows it."""
    for (_, net), group in groupby(enumerate(lines), lambda it: (it[1].number - it[0], it[1].net)):
        stretch = [line for _, line in group]
        values = np.array([line.newtons for line in stretch])
        raw = np.array([line.shown for line in stretch])
        for channel in ("force",) if net else ("force", "force_raw"):
            yield Block(channel, stretch[0].number, None, received_ns, values, raw, "uncertain")


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
            Channel("force", "N", -_FULL_SCALE, _FULL_SCALE, "read", "axial force as the indicator shows it"),
            Channel("force_raw", "N", -_FULL_SCALE, _FULL_SCALE, "read", "the same while it shows gross"),
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

"""Decoder of an indicator's text lines, such as ``ST,GS,+0012.34 kg``.

The lines have no checksum and no sequence. Three checks remain: the format, character by character, the range,
and agreement with an earlier reading.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from drivers.channel import SampleBlock
from drivers.counters import split_at_gaps
from drivers.load_cell.stream_decoder import StreamStatistics
from drivers.wire_files import load_wire_file

CONTRACT: dict[str, Any] = load_wire_file("ascii_load_cell")
"""``wire/ascii_load_cell.toml``: format, units and limits of a line."""

_READING, _STATE, _ZERO = CONTRACT["reading"], CONTRACT["state"], CONTRACT["zero"]
_NEWTONS_PER_UNIT: dict[str, float] = CONTRACT["units"]
FULL_SCALE: float = CONTRACT["instrument"]["full_scale_n"]
"""[N]"""
_LIMITS = CONTRACT["limits"]
# The number is right-aligned in its field and padded with blanks: its last digit is where the field ends.
_LINE = re.compile(
    rf"({_STATE['stable']}|{_STATE['moving']}),({_ZERO['gross']}|{_ZERO['net']}),"
    rf"([+-])(?=.{{{_READING['value_width'] - 1}}}\d ) *(\d+(?:\.\d+)?) +({'|'.join(_NEWTONS_PER_UNIT)})"
)


class AsciiReading(NamedTuple):
    """One reading, as on the wire."""

    number: int
    """Running number of the line; refused lines count."""
    display_value: float
    """In the indicator's unit."""
    force: float
    """[N]"""
    is_net: bool
    """True if the indicator has subtracted its tare."""


class AsciiLoadCellDecoder:
    """Decoder of bytes into blocks of readings.

    A refused line takes a running number, too, since it most likely was a reading.
    """

    def __init__(self, max_step: float = _LIMITS["max_step_n"]) -> None:
        """Begin with an empty stream; ``max_step`` [N] is the largest step between readings that is accepted."""
        self.received = 0
        """Lines accepted."""
        self.corrupted = 0
        """Lines refused: incomplete, garbled, out of range, or beyond the largest step."""
        self.overload_count = 0
        """Lines that show an overload instead of a value."""
        self.resynchronised = 0
        """Lines accepted after refused ones."""
        self.last_ns: int | None = None
        """Bench clock at the last accepted line [ns]."""
        self.overload = False
        """True if the last line shows an overload."""
        self._max_step = max_step
        self._buffer = b""
        self._last_feed_ns = 0
        self._number = -1
        self._last_force: float | None = None
        self._last_accepted: float | None = None
        self._out_of_sync = False

    def feed(self, received_ns: int, data: bytes) -> list[SampleBlock]:
        """Return the blocks of the readings that are complete with ``data``.

        Args:
            received_ns: bench clock at the last byte [ns]. The beginning of a line is dropped if it is older than
                a line lasts.
            data: any part of the stream.
        """
        if self._buffer and received_ns - self._last_feed_ns > _LIMITS["line_s"] * 1e9:
            self._count_refusal(counted=True)
            self._buffer = b""
        self._last_feed_ns = received_ns
        self._buffer += data
        readings = list(self._split_lines())
        if readings:
            self.last_ns = received_ns
        return list(_make_blocks(readings, received_ns))

    def get_statistics(self) -> StreamStatistics:
        """Return the counts of lines; a reading that showed an overload counts as lost."""
        return StreamStatistics(self.received, self.overload_count, self.corrupted, self.resynchronised)

    def snapshot(self) -> dict[str, Any]:
        """Return the state that `restore` needs to decode the bytes after ``at_ns``."""
        return {
            "at_ns": self._last_feed_ns,
            "buffer": self._buffer.hex(),
            "number": self._number,
            "before": self._last_force,
            "accepted": self._last_accepted,
            "astray": self._out_of_sync,
            "wild_step": self._max_step,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a snapshot."""
        self._last_feed_ns, self._number = state["at_ns"], state["number"]
        self._buffer = bytes.fromhex(state["buffer"])
        self._last_force, self._last_accepted = state["before"], state["accepted"]
        self._out_of_sync, self._max_step = state["astray"], state["wild_step"]

    def _split_lines(self) -> Iterator[AsciiReading]:
        *lines, remainder = re.split(rb"[\r\n]+", self._buffer)
        for line in lines:
            if line and (reading := self._parse_line(line.decode("ascii", "replace"))) is not None:
                yield reading
        # Bounded: noise of another baud rate, without line ends, must not fill the memory.
        overlong = len(remainder) > _LIMITS["longest_line"]
        self._buffer = remainder[-_LIMITS["longest_line"] :] if overlong else remainder

    def _parse_line(self, text: str) -> AsciiReading | None:
        self._number += 1
        self.overload = text.startswith(_STATE["overload"] + ",") and len(text) == _READING["length"]
        if self.overload:
            self.overload_count += 1
            return None
        match = _LINE.fullmatch(text) if len(text) == _READING["length"] else None
        if match is None:
            self._count_refusal(counted=self._number > 0)
            return None
        _, zero, sign, digits, unit = match.groups()
        display_value = float(sign + digits)
        force = display_value * _NEWTONS_PER_UNIT[unit]
        # Stored even if implausible: a force that jumps and stays is accepted with its second reading.
        implausible, self._last_force = self._is_implausible(force), force
        if implausible:
            self._count_refusal(counted=self._last_accepted is not None or abs(force) > FULL_SCALE)
            return None
        self.received += 1
        self.resynchronised += self._out_of_sync
        self._last_accepted, self._out_of_sync = force, False
        return AsciiReading(self._number, display_value, force, zero == _ZERO["net"])

    def _is_implausible(self, force: float) -> bool:
        """Return whether a force is out of range, or far from both the last reading and the last accepted one.

        The first reading of all has nothing to agree with and is implausible.
        """
        references = [value for value in (self._last_force, self._last_accepted) if value is not None]
        agrees = any(abs(force - reference) <= self._max_step for reference in references)
        return not agrees or abs(force) > FULL_SCALE

    def _count_refusal(self, counted: bool) -> None:
        """Count a refused line, except the first of all, which is usually incomplete or without a reference."""
        self.corrupted += counted
        self._out_of_sync |= counted


def _make_blocks(readings: list[AsciiReading], received_ns: int) -> Iterator[SampleBlock]:
    """Yield blocks without gap; ``force_raw`` only while the indicator shows the untared force."""
    for stretch in split_at_gaps(readings, lambda reading: reading.is_net):
        values = np.array([reading.force for reading in stretch])
        raw = np.array([reading.display_value for reading in stretch])
        for channel in ("force",) if stretch[0].is_net else ("force", "force_raw"):
            yield SampleBlock(channel, stretch[0].number, None, received_ns, values, raw, "uncertain")

"""From an indicator's lines to numbered readings, without any wire.

A line looks like ``ST,GS,+0012.34 kg``. There is no checksum and no sequence: what can be checked is its form,
character by character, its range, and whether it agrees with a line before.
"""

import re
import tomllib
from collections.abc import Iterator, Mapping
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from drivers.channel import Block

CONTRACT: dict[str, Any] = tomllib.loads(
    (Path(__file__).parent / "wire" / "ascii_load_cell.toml").read_text("utf-8")
)
"""``wire/ascii_load_cell.toml``, which says how a line is laid out."""

_FORM, _STATE, _ZERO = CONTRACT["reading"], CONTRACT["state"], CONTRACT["zero"]
_NEWTONS: dict[str, float] = CONTRACT["units"]
FULL_SCALE: float = CONTRACT["instrument"]["full_scale_n"]
"""[N]"""
_LIMITS = CONTRACT["limits"]
# The number stands at the right edge of its field, filled with blanks: its last digit is where the field ends.
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
        # A line that never ends is no line: without a bound, noise of another baud rate would fill the memory.
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
        # Kept even if doubted: a force that leaps and stays is believed with its second reading.
        doubt, self._before = self._doubt(newtons), newtons
        if doubt:
            self._refused(counted=self._accepted is not None or abs(newtons) > FULL_SCALE)
            return None
        self.received += 1
        self.resynchronised += self._astray
        self._accepted, self._astray = newtons, False
        return Line(self._number, shown, newtons, zero == _ZERO["net"])

    def _doubt(self, newtons: float) -> bool:
        """Whether neither the line before nor the last one taken agrees; the first of all has no witness."""
        witnesses = [seen for seen in (self._before, self._accepted) if seen is not None]
        agrees = any(abs(newtons - seen) <= self._wild_step for seen in witnesses)
        return not agrees or abs(newtons) > FULL_SCALE

    def _refused(self, counted: bool) -> None:
        """The first line of all is cut or without witness as a rule, and no reason for alarm."""
        self.corrupted += counted
        self._astray |= counted


def _blocks(lines: list[Line], received_ns: int) -> Iterator[Block]:
    """Blocks without gap; the untared force only where the indicator shows it."""
    # Number less place stays the same for as long as none is missing.
    for (_, net), group in groupby(enumerate(lines), lambda it: (it[1].number - it[0], it[1].net)):
        stretch = [line for _, line in group]
        values = np.array([line.newtons for line in stretch])
        raw = np.array([line.shown for line in stretch])
        for channel in ("force",) if net else ("force", "force_raw"):
            yield Block(channel, stretch[0].number, None, received_ns, values, raw, "uncertain")

"""What the simulated Modbus instruments share: registers by name, a ring of samples, a clock of their own.

The register maps are the data that the drivers read, too (``drivers/wire``); this side's codec is its own.
"""

import math
import threading
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from sim_rig.device_clock import DeviceClock
from sim_rig.modbus_requests import Illegal
from sim_rig.signals import Signals

_WIRE = Path(__file__).parents[1] / "drivers" / "wire"
_WORD = 65536

Get = Callable[[], float]
Put = Callable[[float], None]


def wire_file(instrument: str) -> dict[str, Any]:
    """The contract with one kind of instrument, as data."""
    return tomllib.loads((_WIRE / f"{instrument}.toml").read_text(encoding="utf-8"))


def size_of(type_: str) -> int:
    """How many registers a number takes."""
    return int(type_[1:]) // 16


def to_words(value: float, type_: str, scale: float, low_first: bool) -> list[int]:
    """A value as registers: saturated where it does not fit, the least signed number where there is none."""
    bits = int(type_[1:])
    least, most = (0, 2**bits - 1) if type_[0] == "u" else (1 - 2 ** (bits - 1), 2 ** (bits - 1) - 1)
    # The least signed number is kept for "no value": it stands one below what a value may be.
    number = least - 1 if math.isnan(value) else min(max(round(value / scale), least), most)
    words = [(number >> shift) % _WORD for shift in range(bits - 16, -1, -16)]
    return words[::-1] if low_first else words


def from_words(words: list[int], type_: str, scale: float, low_first: bool) -> float:
    """The value that registers hold."""
    number = 0
    for word in reversed(words) if low_first else words:
        number = number * _WORD + word
    if type_[0] == "i" and number >= 2 ** (16 * len(words) - 1):
        number -= 2 ** (16 * len(words))
    return number * scale


@dataclass
class Section:
    """Registers that are not single values: read or written as a whole or in part."""

    functions: tuple[int, ...]
    """3 where it is found among holding registers, 4 among input registers."""
    address: int
    length: int
    read: Callable[[], list[int]]
    write: Callable[[int, list[int]], None] | None = None
    """Takes an offset into the section, and words."""


@dataclass
class RegisterBank:
    """Registers by name, as a wire file lays them out."""

    document: dict[str, Any]
    get: dict[str, Get]
    put: dict[str, Put] = field(default_factory=dict)
    sections: list[Section] = field(default_factory=list)

    def read(self, function: int, address: int, count: int) -> list[int]:
        """Words of registers that all exist.

        Raises:
            Illegal: one does not.
        """
        for section in self.sections:
            start = address - section.address
            if function in section.functions and start >= 0 and start + count <= section.length:
                return section.read()[start : start + count]
        found: dict[int, int] = {}
        for entry in self._entries(function):
            at, words = entry["address"], size_of(entry["type"])
            if at < address + count and address < at + words:
                values = self._words(entry, self.get[entry["name"]]())
                found.update(zip(range(at, at + words), values, strict=True))
        if any(place not in found for place in range(address, address + count)):
            raise Illegal(2)
        return [found[place] for place in range(address, address + count)]

    def write(self, address: int, words: list[int]) -> None:
        """Set whole registers, one after the other.

        Raises:
            Illegal: they do not exist, or do not take it.
        """
        for section in self.sections:
            start = address - section.address
            if section.write and start >= 0 and start + len(words) <= section.length:
                section.write(start, words)
                return
        for entry, value in self._meant(address, words):
            if not entry.get("low", -math.inf) <= value <= entry.get("high", math.inf):
                raise Illegal(3)
            self.put[entry["name"]](value)

    def _meant(self, address: int, words: list[int]) -> list[tuple[dict[str, Any], float]]:
        """The registers that stand there, all of them whole, with their new values."""
        starts = {entry["address"]: entry for entry in self._entries(3)}
        meant, low_first = [], self.document["word_order"] == "low_first"
        while words:
            entry = starts.get(address)
            if entry is None or size_of(entry["type"]) > len(words):
                raise Illegal(2)
            size = size_of(entry["type"])
            meant.append((entry, from_words(words[:size], entry["type"], entry.get("scale", 1.0), low_first)))
            address, words = address + size, words[size:]
        return meant

    def _words(self, entry: dict[str, Any], value: float) -> list[int]:
        low_first = self.document["word_order"] == "low_first"
        return to_words(value, entry["type"], entry.get("scale", 1.0), low_first)

    def _entries(self, function: int) -> list[dict[str, Any]]:
        return [entry for entry in self.document["register"] if (entry["access"] == "read") == (function == 4)]


class SampleRing:
    """The newest samples of some channels, numbered on the instrument's own grid of instants."""

    def __init__(
        self, document: dict[str, Any], signals: Signals, clock: DeviceClock, status: Callable[[], int]
    ) -> None:
        """Begin.

        Args:
            document: the wire file.
            signals: the rig.
            clock: the instrument's own.
            status: what the header says of the instrument.
        """
        self.wanted = 0
        self.boot = 1
        self._document, self._signals, self._clock, self._status = document, signals, clock, status
        self._ring = document["ring"]
        self._interval: int = round(1e9 / self._ring["rate"])
        self._names = [column["name"] for column in self._ring["columns"]]
        self._from = 0
        self._lock = threading.RLock()

    def microseconds(self, rig_ns: int) -> int:
        """The instrument's clock [us], wrapped to 32 bits."""
        return self._clock.ns(rig_ns) // 1000 % 2**32

    def restart(self) -> None:
        """The instrument has been switched off and on: numbers and clock begin anew."""
        with self._lock:
            now = self._signals.now_ns()
            self.boot, self.wanted = self.boot % 65535 + 1, 0
            self._from = now // self._interval
            self._clock = self._clock._replace(offset_ns=self._clock.offset_ns - self._clock.ns(now))

    def registers(self) -> dict[str, Get]:
        """The registers that every instrument with a ring has."""
        latest = {name: (lambda name=name: self.newest(name)[1]) for name in self._names}
        return {
            "identity": lambda: self._document["identity"],
            "boot": lambda: self.boot,
            "interval": lambda: self._interval * 1e-9,
            "newest": lambda: self._number(self.newest(self._names[0])[0]),
            "now": lambda: self.microseconds(self._signals.now_ns()) * 1e-6,
            "sampled": lambda: self.microseconds(self.newest(self._names[0])[0]) * 1e-6,
            "wanted": lambda: self.wanted,
            **latest,
        }

    def want(self, number: float) -> None:
        """Let the block begin at a sample."""
        self.wanted = round(number)

    def section(self) -> Section:
        """The block as registers."""
        return Section((3, 4), self._ring["address"], self._ring["length"], self.block)

    def newest(self, channel: str) -> tuple[int, float]:
        """Instant [ns] of the rig's clock and value of the newest sample; NaN before the first."""
        now = self._signals.now_ns()
        times, values = self._signals.latest(channel, 1, now)
        return (int(times[-1]), float(values[-1])) if len(times) else (now, math.nan)

    def block(self) -> list[int]:
        """The block that begins at the wanted sample, or at the oldest one kept."""
        with self._lock:
            now = self._signals.now_ns()
            # What has come since the wanted sample is enough; to look through all that is kept takes long.
            size = min(self._ring["size"], max(1, now // self._interval - self._from - self.wanted + 2))
            held = [self._signals.latest(name, size, now) for name in self._names]
            # As far as every channel has come: a sample is whole, or not there yet.
            newest = self._number(min(int(times[-1]) for times, _ in held)) if all(len(t) for t, _ in held) else -1
            oldest = max(
                [0, newest - self._ring["size"] + 1, *(self._number(int(t[0])) for t, _ in held if len(t))]
            )
            first = max(self.wanted, oldest)
            count = max(0, min(newest - first + 1, self._capacity()))
            return self._words(held, first, count, newest, now)

    def _number(self, rig_ns: int) -> int:
        return int((rig_ns + self._interval // 2) // self._interval - self._from)

    def _capacity(self) -> int:
        header = sum(size_of(entry["type"]) for entry in self._ring["header"])
        sample = sum(size_of(column["type"]) for column in self._ring["columns"])
        return int((self._ring["length"] - header) // sample)

    def _words(self, held: list[Any], first: int, count: int, newest: int, now: int) -> list[int]:
        """The block as it goes out; held: times and values of each channel."""
        # The sample of a number lies within half an interval of its place on the grid, before or behind.
        edges = (np.arange(first, first + count) + self._from) * self._interval + self._interval // 2
        places = [np.searchsorted(times, edges) - 1 for times, _ in held]
        begins = int(held[0][0][places[0][0]]) if count else now
        head = {
            "boot": self.boot,
            "first": first,
            "time": self.microseconds(begins),
            "now": self.microseconds(now),
            "newest": max(newest, 0),
            "count": count,
            "status": self._status(),
        }
        low_first = self._document["word_order"] == "low_first"
        words = [w for e in self._ring["header"] for w in to_words(head[e["name"]], e["type"], 1.0, low_first)]
        for sample in range(count):
            for column, (_, values), place in zip(self._ring["columns"], held, places, strict=True):
                words += to_words(float(values[place[sample]]), column["type"], column["scale"], low_first)
        return words + [0] * (self._ring["length"] - len(words))

"""Registers and sample ring buffer of the simulated Modbus instruments.

The register maps are the wire files that the drivers read as well. The codec here is independent of the drivers'.
"""

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sim_rig.live import DeviceClock, RigInterface
from sim_rig.protocols import ModbusRequestError

_WORD_RANGE = 65536

Getter = Callable[[], float]
Setter = Callable[[float], None]


def count_words(type_: str) -> int:
    """Return the number of registers of a type."""
    return int(type_[1:]) // 16


def encode_words(value: float, type_: str, scale: float, low_first: bool) -> list[int]:
    """Return a value as registers: saturated if out of range, the least signed number for NaN."""
    bits = int(type_[1:])
    least, most = (0, 2**bits - 1) if type_[0] == "u" else (1 - 2 ** (bits - 1), 2 ** (bits - 1) - 1)
    # The least signed number means "no value" and is one below the smallest value.
    number = least - 1 if math.isnan(value) else min(max(round(value / scale), least), most)
    words = [(number >> shift) % _WORD_RANGE for shift in range(bits - 16, -1, -16)]
    return words[::-1] if low_first else words


def decode_words(words: list[int], type_: str, scale: float, low_first: bool) -> float:
    """Return the value of registers."""
    number = 0
    for word in reversed(words) if low_first else words:
        number = number * _WORD_RANGE + word
    if type_[0] == "i" and number >= 2 ** (16 * len(words) - 1):
        number -= 2 ** (16 * len(words))
    return number * scale


@dataclass
class RegisterSection:
    """A contiguous section of registers that is read or written in whole or in part."""

    functions: tuple[int, ...]
    """3 if it is among the holding registers, 4 if among the input registers."""
    address: int
    length: int
    read: Callable[[], list[int]]
    write: Callable[[int, list[int]], None] | None = None
    """Function of an offset into the section, and words."""


@dataclass
class RegisterBank:
    """Registers by name, laid out by a wire file."""

    document: dict[str, Any]
    getters: dict[str, Getter]
    setters: dict[str, Setter] = field(default_factory=dict)
    sections: list[RegisterSection] = field(default_factory=list)

    def read(self, function: int, address: int, count: int) -> list[int]:
        """Return words of registers.

        Raises:
            ModbusRequestError: one does not exist.
        """
        for section in self.sections:
            start = address - section.address
            if function in section.functions and start >= 0 and start + count <= section.length:
                return section.read()[start : start + count]
        contents: dict[int, int] = {}
        for entry in self._select_entries(function):
            start, size = entry["address"], count_words(entry["type"])
            if start < address + count and address < start + size:
                words = self._encode(entry, self.getters[entry["name"]]())
                contents.update(zip(range(start, start + size), words, strict=True))
        if any(register not in contents for register in range(address, address + count)):
            raise ModbusRequestError(2)
        return [contents[register] for register in range(address, address + count)]

    def write(self, address: int, words: list[int]) -> None:
        """Set whole registers, one after the other.

        Raises:
            ModbusRequestError: they do not exist, or do not accept the value.
        """
        for section in self.sections:
            start = address - section.address
            if section.write and start >= 0 and start + len(words) <= section.length:
                section.write(start, words)
                return
        for entry, value in self._decode_write(address, words):
            if not entry.get("low", -math.inf) <= value <= entry.get("high", math.inf):
                raise ModbusRequestError(3)
            self.setters[entry["name"]](value)

    def _decode_write(self, address: int, words: list[int]) -> list[tuple[dict[str, Any], float]]:
        """Return the registers at an address, all of them complete, with their new values."""
        starts = {entry["address"]: entry for entry in self._select_entries(3)}
        entries, low_first = [], self.document["word_order"] == "low_first"
        while words:
            entry = starts.get(address)
            if entry is None or count_words(entry["type"]) > len(words):
                raise ModbusRequestError(2)
            size = count_words(entry["type"])
            entries.append((entry, decode_words(words[:size], entry["type"], entry.get("scale", 1.0), low_first)))
            address, words = address + size, words[size:]
        return entries

    def _encode(self, entry: dict[str, Any], value: float) -> list[int]:
        low_first = self.document["word_order"] == "low_first"
        return encode_words(value, entry["type"], entry.get("scale", 1.0), low_first)

    def _select_entries(self, function: int) -> list[dict[str, Any]]:
        return [entry for entry in self.document["register"] if (entry["access"] == "read") == (function == 4)]


class SampleRingBuffer:
    """The newest samples of some channels, numbered on the instrument's own sampling grid."""

    def __init__(
        self, document: dict[str, Any], signals: RigInterface, clock: DeviceClock, status: Callable[[], int]
    ) -> None:
        """Start with sample number 0.

        Args:
            document: the wire file.
            signals: the rig.
            clock: the instrument's clock.
            status: returns the status for the header.
        """
        self.start_number = 0
        self.boot = 1
        self._document, self._signals, self._clock, self._status = document, signals, clock, status
        self._ring = document["ring"]
        self._interval: int = round(1e9 / self._ring["rate"])
        self._names = [column["name"] for column in self._ring["columns"]]
        self._origin = 0
        self._lock = threading.RLock()

    def read_clock_us(self, rig_ns: int) -> int:
        """Return the instrument's clock [us], wrapped to 32 bits."""
        return self._clock.read_ns(rig_ns) // 1000 % 2**32

    def restart(self) -> None:
        """Switch the instrument off and on: sample numbers and clock restart."""
        with self._lock:
            now = self._signals.now_ns()
            self.boot, self.start_number = self.boot % 65535 + 1, 0
            self._origin = now // self._interval
            self._clock = self._clock._replace(offset_ns=self._clock.offset_ns - self._clock.read_ns(now))

    def make_getters(self) -> dict[str, Getter]:
        """Return the registers that every instrument with a ring buffer has."""
        latest = {name: (lambda name=name: self.read_newest(name)[1]) for name in self._names}
        return {
            "identity": lambda: self._document["identity"],
            "boot": lambda: self.boot,
            "interval": lambda: self._interval * 1e-9,
            "newest": lambda: self._compute_number(self.read_newest(self._names[0])[0]),
            "clock": lambda: self.read_clock_us(self._signals.now_ns()) * 1e-6,
            "sampled": lambda: self.read_clock_us(self.read_newest(self._names[0])[0]) * 1e-6,
            "block_start": lambda: self.start_number,
            **latest,
        }

    def set_start(self, number: float) -> None:
        """Set the number of the block's first sample."""
        self.start_number = round(number)

    def make_section(self) -> RegisterSection:
        """Return the block as a section of registers."""
        return RegisterSection((3, 4), self._ring["address"], self._ring["length"], self.make_block)

    def read_newest(self, channel: str) -> tuple[int, float]:
        """Return instant [ns] on the rig's clock and value of the newest sample; NaN before the first."""
        now = self._signals.now_ns()
        times, values = self._signals.read_latest(channel, 1, now)
        return (int(times[-1]), float(values[-1])) if len(times) else (now, math.nan)

    def make_block(self) -> list[int]:
        """Return the block that begins at the requested sample, or at the oldest one kept."""
        with self._lock:
            now = self._signals.now_ns()
            # Only the samples since the requested one: searching the whole buffer takes long.
            size = min(self._ring["size"], max(1, now // self._interval - self._origin - self.start_number + 2))
            samples = [self._signals.read_latest(name, size, now) for name in self._names]
            # Up to the newest instant that all channels have reached, so that each sample is complete.
            newest = -1
            if all(len(times) for times, _ in samples):
                newest = self._compute_number(min(int(times[-1]) for times, _ in samples))
            starts = [self._compute_number(int(times[0])) for times, _ in samples if len(times)]
            oldest = max([0, newest - self._ring["size"] + 1, *starts])
            first = max(self.start_number, oldest)
            count = max(0, min(newest - first + 1, self._compute_capacity()))
            return self._encode(samples, first, count, newest, now)

    def _compute_number(self, rig_ns: int) -> int:
        return int((rig_ns + self._interval // 2) // self._interval - self._origin)

    def _compute_capacity(self) -> int:
        header = sum(count_words(entry["type"]) for entry in self._ring["header"])
        sample = sum(count_words(column["type"]) for column in self._ring["columns"])
        return int((self._ring["length"] - header) // sample)

    def _encode(self, samples: list[Any], first: int, count: int, newest: int, now: int) -> list[int]:
        """Return the words of a block; samples: times and values of each channel."""
        # The sample of a number is within half an interval of its instant on the grid.
        edges = (np.arange(first, first + count) + self._origin) * self._interval + self._interval // 2
        indices = [np.searchsorted(times, edges) - 1 for times, _ in samples]
        start_ns = int(samples[0][0][indices[0][0]]) if count else now
        low_first = self._document["word_order"] == "low_first"
        header = self._make_header(first, count, newest, start_ns, now)
        words = [
            w for e in self._ring["header"] for w in encode_words(header[e["name"]], e["type"], 1.0, low_first)
        ]
        for i in range(count):
            for column, (_, values), index in zip(self._ring["columns"], samples, indices, strict=True):
                words += encode_words(float(values[index[i]]), column["type"], column["scale"], low_first)
        return words + [0] * (self._ring["length"] - len(words))

    def _make_header(self, first: int, count: int, newest: int, start_ns: int, now: int) -> dict[str, int]:
        return {
            "boot": self.boot,
            "first": first,
            "time": self.read_clock_us(start_ns),
            "clock": self.read_clock_us(now),
            "newest": max(newest, 0),
            "count": count,
            "status": self._status(),
        }

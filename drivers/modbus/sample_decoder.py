"""Decoder of ring buffer blocks into numbered samples, without any wire.

It depends only on the words and their times, so that a replay of the recorded frames gives the same blocks bit for
bit.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drivers.channel import Array, Quality, SampleBlock
from drivers.counters import compute_step
from drivers.errors import InvalidReplyError, NotConnectedError
from drivers.transport import RegisterMap, RegisterType, WordOrder, count_words, decode_number

_COUNTER_PERIOD = 2**32
"""Period of sample numbers, and of the device clock [us]."""


class Column(NamedTuple):
    """One channel in a sample."""

    name: str
    type: RegisterType
    scale: float
    unit: str


class RingBufferLayout:
    """Layout of a block in its registers, from the section ``ring`` of the wire file."""

    def __init__(self, map_: RegisterMap) -> None:
        ring: dict[str, Any] = map_.document["ring"]
        self.order: WordOrder = map_.order
        self.address, self.length = int(ring["address"]), int(ring["length"])
        self.uncertain = int(ring["uncertain"])
        self.size = int(ring["size"])
        self.interval_ns: int = round(1e9 / ring["rate"])
        self.header: list[tuple[str, RegisterType]] = [(entry["name"], entry["type"]) for entry in ring["header"]]
        self.columns = [Column(**entry) for entry in ring["columns"]]
        self.header_words = sum(count_words(type_) for _, type_ in self.header)
        self.sample_words = sum(count_words(column.type) for column in self.columns)
        self.capacity = (self.length - self.header_words) // self.sample_words

    def decode_header(self, words: Sequence[int]) -> dict[str, int]:
        """Return the numbers of the header by name."""
        header, offset = {}, 0
        for name, type_ in self.header:
            header[name] = decode_number(words[offset : offset + count_words(type_)], type_, self.order)
            offset += count_words(type_)
        return header

    def decode_samples(self, words: Sequence[int], count: int) -> list[npt.NDArray[np.int64]]:
        """Return the raw samples, one array (count,) per column."""
        stop = self.header_words + count * self.sample_words
        table = np.array(words[self.header_words : stop], dtype=np.int64).reshape(count, self.sample_words)
        samples, offset = [], 0
        for column in self.columns:
            size = count_words(column.type)
            samples.append(_combine_words(table[:, offset : offset + size], column.type, self.order))
            offset += size
        return samples


def _combine_words(words: npt.NDArray[np.int64], type_: RegisterType, order: WordOrder) -> npt.NDArray[np.int64]:
    """Return numbers of one or two words each; words (samples, 1 or 2)."""
    high_first = words if order == "high_first" else words[:, ::-1]
    number = high_first[:, 0] if words.shape[1] == 1 else high_first[:, 0] * 65536 + high_first[:, 1]
    half = 1 << (16 * words.shape[1] - 1)
    return np.where(number >= half, number - 2 * half, number) if type_[0] == "i" else number


class BlockReadout(NamedTuple):
    """Content of one reading of the ring buffer."""

    blocks: list[SampleBlock]
    clock_ns: int
    """Device clock when the instrument assembled the block [ns]."""
    has_more: bool
    """True if the instrument has more samples after these."""


class ModbusDecoder:
    """Decoder of blocks, in the order in which they were requested."""

    def __init__(self, name: str, layout: RingBufferLayout) -> None:
        """Prepare; no block was decoded yet.

        Args:
            name: name of the instrument, for messages.
            layout: layout of its blocks.
        """
        self.lost = self.status = 0
        self.next_number = 0
        """Number of the next sample to request, as counted by the instrument."""
        self.newest_ns: int | None = None
        """Device clock at the latest sample [ns]."""
        self._name, self._layout = name, layout
        self._boot = self._origin = self._device_us = 0

    def begin(self, boot: int, newest: int, clock: int) -> None:
        """Begin with the next sample that the instrument takes.

        Args:
            boot: number of its power-ups.
            newest: number of its latest sample.
            clock: its clock, wrapped [us].
        """
        self._boot, self._device_us = boot, clock
        self.next_number = self._origin = (newest + 1) % _COUNTER_PERIOD
        self.lost, self.newest_ns = 0, None

    def snapshot(self) -> dict[str, int]:
        """Return the state that `restore` needs to decode the following blocks."""
        return {
            "boot": self._boot,
            "origin": self._origin,
            "device_us": self._device_us,
            "wanted": self.next_number,
            "status": self.status,
        }

    def restore(self, state: dict[str, int]) -> None:
        """Continue from a snapshot."""
        self._boot, self._origin, self._device_us = state["boot"], state["origin"], state["device_us"]
        self.next_number, self.status = state["wanted"], state["status"]

    def unwrap_clock(self, microseconds: int) -> int:
        """Return the device clock without its wraps [ns], from a reading near the last ones."""
        last = self._device_us  # read once: another thread may request a value meanwhile
        self._device_us = last = last + compute_step(microseconds, last, _COUNTER_PERIOD)
        return last * 1000

    def decode_block(self, words: Sequence[int], received_ns: int) -> BlockReadout:
        """Decode the samples of a block, and count requested samples before it as lost.

        Args:
            words: words of the block.
            received_ns: bench clock when the block was complete [ns].

        Raises:
            NotConnectedError: the instrument has restarted.
            InvalidReplyError: the block is not the requested one.
        """
        header = self._layout.decode_header(words)
        self._check_header(header)
        clock_ns = self.unwrap_clock(header["clock"])
        self.status = header["status"]
        blocks = self._make_blocks(header, words, received_ns) if header["count"] else []
        has_more = compute_step(header["newest"], self.next_number, _COUNTER_PERIOD) >= 0
        return BlockReadout(blocks, clock_ns, has_more)

    def _check_header(self, header: dict[str, int]) -> None:
        """Check that a block is the requested one."""
        if header["boot"] != self._boot:
            raise NotConnectedError(
                f"{self._name}: it has restarted ({self._boot} power-ups, now {header['boot']}); its clock and "
                "settings are lost, connect again"
            )
        # The block may begin later than requested only if the ring has overrun: then at the oldest kept sample.
        ahead = compute_step(header["first"], self.next_number, _COUNTER_PERIOD)
        is_kept = 0 <= compute_step(header["newest"], header["first"], _COUNTER_PERIOD) < self._layout.size
        if header["count"] > self._layout.capacity or (ahead and not (is_kept and ahead > 0)):
            raise InvalidReplyError(
                f"{self._name}: a block of {header['count']} samples from {header['first']} arrived, but "
                f"{self.next_number} was requested and {self._layout.capacity} is the most; it was not used"
            )

    def _make_blocks(self, header: dict[str, int], words: Sequence[int], received_ns: int) -> list[SampleBlock]:
        first, count = header["first"], header["count"]
        self.lost += (first - self.next_number) % _COUNTER_PERIOD
        times = self.unwrap_clock(header["time"]) + np.arange(count, dtype=np.int64) * self._layout.interval_ns
        self.next_number = (first + count) % _COUNTER_PERIOD
        self.newest_ns = int(times[-1])
        number = (first - self._origin) % _COUNTER_PERIOD
        quality: Quality = "uncertain" if self.status & self._layout.uncertain else "good"
        blocks = []
        for column, raw in zip(self._layout.columns, self._layout.decode_samples(words, count), strict=True):
            values = _scale_values(raw, column)
            column_quality: Quality = "bad" if np.isnan(values).any() else quality
            blocks.append(
                SampleBlock(
                    column.name, number, times, received_ns, values, raw.astype(np.float64), column_quality
                )
            )
        return blocks


def _scale_values(raw: npt.NDArray[np.int64], column: Column) -> Array:
    """Return samples in their unit; NaN where the instrument had none."""
    values = np.asarray(raw * column.scale, dtype=np.float64)
    if column.type[0] == "i":
        values[raw == -(2 ** (16 * count_words(column.type) - 1))] = np.nan
    return values

"""From the words of a Modbus ring to numbered samples, without any wire.

It depends on nothing but the words and when they came, so that a replay of the recorded frames gives the same
blocks bit for bit.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drivers.channel import Block, Numbers, Quality
from drivers.errors import BadReply, NotConnected
from drivers.modbus_registers import RegisterMap, Type, WordOrder, decode, words_in

_WRAP = 2**32
_BEHIND = 2**31
"""A step as large, of numbers and clocks that wrap, is one backwards."""


class Column(NamedTuple):
    """What one sample holds of one channel."""

    name: str
    type: Type
    scale: float
    unit: str


class Layout:
    """How a block stands in its registers, from the wire file's section ``ring``."""

    def __init__(self, map_: RegisterMap) -> None:
        ring: dict[str, Any] = map_.document["ring"]
        self.order: WordOrder = map_.order
        self.address, self.length = int(ring["address"]), int(ring["length"])
        self.uncertain = int(ring["uncertain"])
        self.size, self.interval_ns = int(ring["size"]), round(1e9 / ring["rate"])
        self.header: list[tuple[str, Type]] = [(entry["name"], entry["type"]) for entry in ring["header"]]
        self.columns = [Column(**entry) for entry in ring["columns"]]
        self.header_words = sum(words_in(type_) for _, type_ in self.header)
        self.sample_words = sum(words_in(column.type) for column in self.columns)
        self.capacity = (self.length - self.header_words) // self.sample_words

    def head(self, words: Sequence[int]) -> dict[str, int]:
        """The header's numbers."""
        found, at = {}, 0
        for name, type_ in self.header:
            found[name] = decode(words[at : at + words_in(type_)], type_, self.order)
            at += words_in(type_)
        return found

    def samples(self, words: Sequence[int], count: int) -> list[npt.NDArray[np.int64]]:
        """The raw samples, one array (count,) a column."""
        stop = self.header_words + count * self.sample_words
        table = np.array(words[self.header_words : stop], dtype=np.int64).reshape(count, self.sample_words)
        found, at = [], 0
        for column in self.columns:
            found.append(_numbers(table[:, at : at + words_in(column.type)], column.type, self.order))
            at += words_in(column.type)
        return found


def _numbers(words: npt.NDArray[np.int64], type_: Type, order: WordOrder) -> npt.NDArray[np.int64]:
    """Numbers of one or two words each; words (samples, 1 or 2)."""
    high_first = words if order == "high_first" else words[:, ::-1]
    number = high_first[:, 0] if words.shape[1] == 1 else high_first[:, 0] * 65536 + high_first[:, 1]
    half = 1 << (16 * words.shape[1] - 1)
    return np.where(number >= half, number - 2 * half, number) if type_[0] == "i" else number


class RingDecoder:
    """Takes blocks in the order they were asked for."""

    def __init__(self, name: str, layout: Layout) -> None:
        """Nothing has come yet.

        Args:
            name: of the instrument, for messages.
            layout: of its blocks.
        """
        self.lost = self.status = 0
        self.wanted = 0
        """Number of the sample to ask for next, as it stands in the instrument."""
        self.newest_ns: int | None = None
        """The instrument's clock at the newest sample [ns]."""
        self._name, self._layout = name, layout
        self._boot = self._origin = self._device_us = 0

    def begin(self, boot: int, newest: int, now: int) -> None:
        """Begin with the next sample that the instrument makes.

        Args:
            boot: how often it has been switched on.
            newest: number of its newest sample.
            now: its clock, wrapped [us].
        """
        self._boot, self._device_us = boot, now
        self.wanted = self._origin = (newest + 1) % _WRAP
        self.lost, self.newest_ns = 0, None

    def state(self) -> dict[str, int]:
        """What `resume` needs to go on from here."""
        return {
            "boot": self._boot, "origin": self._origin, "device_us": self._device_us, "wanted": self.wanted,
            "status": self.status,
        }  # fmt: skip

    def resume(self, state: dict[str, int]) -> None:
        """Go on from a `state`."""
        self._boot, self._origin, self._device_us = state["boot"], state["origin"], state["device_us"]
        self.wanted, self.status = state["wanted"], state["status"]

    def device_ns(self, microseconds: int) -> int:
        """The instrument's clock [ns] from its wrapped microseconds, close to the last ones seen."""
        last = self._device_us  # read once: another thread may ask for a value meanwhile
        step = (microseconds - last) % _WRAP
        self._device_us = last = last + (step - _WRAP if step >= _BEHIND else step)
        return last * 1000

    def take(self, words: Sequence[int], received_ns: int) -> "Taken":
        """The samples of a block; what was wanted and skipped is lost.

        Args:
            words: of the block.
            received_ns: bench clock when it was complete [ns].

        Raises:
            NotConnected: the instrument has restarted.
            BadReply: it is not the block that was wanted.
        """
        wanted = self.wanted
        head = self._checked(self._layout.head(words))
        now_ns = self.device_ns(head["now"])
        self.status = head["status"]
        blocks = self._blocks(head, words, received_ns) if head["count"] else []
        return Taken(blocks, now_ns, (head["newest"] - (self.wanted if blocks else wanted)) % _WRAP < _BEHIND)

    def _checked(self, head: dict[str, int]) -> dict[str, int]:
        """The header of a block that is the one wanted."""
        if head["boot"] != self._boot:
            raise NotConnected(
                f"{self._name}: it has restarted ({self._boot} power-ups, now {head['boot']}); its clock and "
                "settings have gone, connect again"
            )
        # Ahead of what was wanted only where the ring has overrun: then it begins at the oldest that is kept.
        ahead = (head["first"] - self.wanted) % _WRAP
        kept = (head["newest"] - head["first"]) % _WRAP < self._layout.size
        if head["count"] > self._layout.capacity or (ahead and not (kept and ahead < _BEHIND)):
            raise BadReply(
                f"{self._name}: a block of {head['count']} samples from {head['first']} came where {self.wanted} "
                f"was wanted and {self._layout.capacity} is the most; it was not used"
            )
        return head

    def _blocks(self, head: dict[str, int], words: Sequence[int], received_ns: int) -> list[Block]:
        self.lost += (head["first"] - self.wanted) % _WRAP
        count = head["count"]
        since = self.device_ns(head["time"])
        times = since + np.arange(count, dtype=np.int64) * self._layout.interval_ns
        self.wanted = (head["first"] + count) % _WRAP
        self.newest_ns = int(times[-1])
        number = (head["first"] - self._origin) % _WRAP
        quality: Quality = "uncertain" if self.status & self._layout.uncertain else "good"
        made = []
        for column, raw in zip(self._layout.columns, self._layout.samples(words, count), strict=True):
            values = _values(raw, column)
            bad: Quality = "bad" if np.isnan(values).any() else quality
            made.append(Block(column.name, number, times, received_ns, values, raw.astype(np.float64), bad))
        return made


class Taken(NamedTuple):
    """What a block brought."""

    blocks: list[Block]
    now_ns: int
    """The instrument's clock when it was made up [ns]."""
    more: bool
    """Whether more samples stand behind it."""


def _values(raw: npt.NDArray[np.int64], column: Column) -> Numbers:
    """Samples in their unit; NaN where the instrument had none."""
    values = np.asarray(raw * column.scale, dtype=np.float64)
    if column.type[0] == "i":
        values[raw == -(2 ** (16 * words_in(column.type) - 1))] = np.nan
    return values

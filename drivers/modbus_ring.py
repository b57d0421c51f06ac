"""A ring of samples in an instrument, read in blocks over Modbus without loss.

The host writes the number of the sample that it wants and reads a block that begins there. Nothing moves on
before the host asks for the next number, so a block that did not come is simply read again. A block carries the
number of its first sample: an old one cannot pass for the one wanted. Where the ring has overrun, the block begins
at the oldest sample kept, and what was lost is counted. Reading is paced: no more often than ``every`` seconds, or
the wire would be asked for each sample alone.
"""

import time
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drivers.channel import Block, Numbers, Quality
from drivers.errors import BadReply, DriverError, NotConnected
from drivers.instrument import Clock, Health
from drivers.modbus_line import Answer
from drivers.modbus_registers import RegisterMap, Registers, Type, WordOrder, decode, words_in

_WRAP = 2**32
_BEHIND = 2**31


class Stamp(NamedTuple):
    """The instrument's clock beside the bench's: it was read between the two."""

    device_ns: int
    """The instrument's clock, unwrapped [ns]."""
    sent_ns: int
    """Bench clock when the question went out [ns]."""
    received_ns: int
    """Bench clock when the answer was complete [ns]."""


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


class Ring:
    """Reads one instrument's samples block by block."""

    def __init__(self, registers: Registers, clock: Clock, every: float = 0.02, silence: float = 1.0) -> None:
        """Prepare; nothing is asked yet.

        Args:
            registers: of the instrument.
            clock: the bench clock.
            every: [s] between readings of the ring at least.
            silence: [s] without a good block after which the wire counts as gone.
        """
        self.layout = Layout(registers.map)
        self.lost = self.status = 0
        self.stamp: Stamp | None = None
        self._registers, self._clock, self._every, self._silence = registers, clock, every, silence
        self._boot = self._wanted = self._origin = 0
        self._newest_ns: int | None = None
        self._device_us = 0
        self._next = 0.0
        self._failing_since: float | None = None
        self._words = "not connected"

    def start(self) -> None:
        """Check who answers, and begin with the next sample that it makes.

        Raises:
            NotConnected, NoReply, BadReply, Refused: it does not answer, or is another instrument.
        """
        name, map_ = self._registers.line.name, self._registers.map
        found, answer = self._registers.read_together("identity", "boot", "interval", "newest", "now")
        if found["identity"].raw != map_.identity:
            raise BadReply(
                f"{name}: answers as {found['identity'].raw:#06x}, a {map_.instrument} as {map_.identity:#06x}; "
                "check address and unit"
            )
        if found["interval"].raw * 1000 != self.layout.interval_ns:
            raise BadReply(
                f"{name}: samples every {found['interval'].raw} us, expected are "
                f"{self.layout.interval_ns // 1000} us; set the instrument's rate"
            )
        self._boot, self._device_us = found["boot"].raw, found["now"].raw
        self._wanted = self._origin = (found["newest"].raw + 1) % _WRAP
        self.lost, self._newest_ns = 0, None
        self.stamp = Stamp(self._device_us * 1000, answer.sent_ns, answer.received_ns)
        self._next, self._failing_since, self._words = 0.0, None, ""

    def acquire(self, timeout: float) -> list[Block]:
        """Samples made since the last call, all that are there, waiting up to ``timeout`` [s] for the first.

        A block that did not come is read again; only a silence that lasts is an error.

        Raises:
            NotConnected: the wire has gone, nothing good has come for long, or the instrument has restarted.
        """
        deadline = time.monotonic() + timeout
        blocks: list[Block] = []
        while self._waits_until_due(deadline):
            try:
                more = self._take(blocks)
            except NotConnected:
                raise
            except DriverError as error:
                self._failed(error)
                more = False
            if blocks and (not more or time.monotonic() > deadline):
                break
        return blocks

    def age(self) -> float | None:
        """[s] since the newest sample was made, at most: its way over the wire included; none before the first."""
        if self._newest_ns is None or self.stamp is None:
            return None
        return (self.stamp.device_ns - self._newest_ns + self._clock() - self.stamp.sent_ns) * 1e-9

    def device_ns(self, microseconds: int) -> int:
        """The instrument's clock [ns] from its wrapped microseconds, close to the last ones seen."""
        step = (microseconds - self._device_us) % _WRAP
        self._device_us += step - _WRAP if step >= _BEHIND else step
        return self._device_us * 1000

    def health(self) -> Health:
        """Counts and state."""
        line = self._registers.line
        words = self._words if line.connected else "not connected"
        return Health(
            line.connected, line.received, self.lost, line.corrupted, line.resynchronised, line.last_ns, words
        )

    def _waits_until_due(self, deadline: float) -> bool:
        """Sleep until the ring may be read again; false where the deadline comes first."""
        now = time.monotonic()
        if self._next > deadline:
            time.sleep(max(0.0, deadline - now))
            return False
        time.sleep(max(0.0, self._next - now))
        return True

    def _take(self, blocks: list[Block]) -> bool:
        """Read the next block; whether more samples stand behind it."""
        self._next = time.monotonic() + self._every
        self._registers.write("wanted", self._wanted)
        answer = self._registers.line.read("input", self.layout.address, self.layout.length)
        head = self._checked(self.layout.head(answer.words))
        self._failing_since, self._words = None, ""
        self._note(head, answer)
        if head["count"]:
            blocks.extend(self._blocks(head, answer))
        more = (head["newest"] - self._wanted) % _WRAP < _BEHIND
        if more:
            self._next = 0.0
        return more

    def _checked(self, head: dict[str, int]) -> dict[str, int]:
        """The header of a block that is the one wanted."""
        name = self._registers.line.name
        if head["boot"] != self._boot:
            self._words = "restarted"
            raise NotConnected(
                f"{name}: it has restarted ({self._boot} power-ups, now {head['boot']}); its clock and settings "
                "have gone, connect again"
            )
        ahead = (head["first"] - self._wanted) % _WRAP
        kept = (head["newest"] - head["first"]) % _WRAP < self.layout.size
        if head["count"] > self.layout.capacity or (ahead and not (kept and ahead < _BEHIND)):
            raise BadReply(
                f"{name}: a block of {head['count']} samples from {head['first']} came where {self._wanted} was "
                f"wanted and {self.layout.capacity} is the most; it was not used"
            )
        return head

    def _note(self, head: dict[str, int], answer: Answer) -> None:
        now_ns = self.device_ns(head["now"])
        self.stamp = Stamp(now_ns, answer.sent_ns, answer.received_ns)
        self.status = head["status"]

    def _blocks(self, head: dict[str, int], answer: Answer) -> list[Block]:
        """The samples of an accepted block; what was wanted and skipped is lost."""
        self.lost += (head["first"] - self._wanted) % _WRAP
        count = head["count"]
        since = self.device_ns(head["time"])
        times = since + np.arange(count, dtype=np.int64) * self.layout.interval_ns
        self._wanted = (head["first"] + count) % _WRAP
        self._newest_ns = int(times[-1])
        number = (head["first"] - self._origin) % _WRAP
        quality: Quality = "uncertain" if self.status & self.layout.uncertain else "good"
        made = []
        for column, raw in zip(self.layout.columns, self.layout.samples(answer.words, count), strict=True):
            values = _values(raw, column)
            bad: Quality = "bad" if np.isnan(values).any() else quality
            made.append(Block(column.name, number, times, answer.received_ns, values, raw.astype(np.float64), bad))
        return made

    def _failed(self, error: DriverError) -> None:
        """Note a block that did not come.

        Raises:
            NotConnected: none has come for long.
        """
        now = time.monotonic()
        self._failing_since = now if self._failing_since is None else self._failing_since
        silent, self._words = now - self._failing_since, str(error)
        if silent > self._silence:
            raise NotConnected(
                f"{self._registers.line.name}: no good block for {silent:.1f} s, the limit is "
                f"{self._silence:.1f} s; last: {error}"
            ) from error


def _values(raw: npt.NDArray[np.int64], column: Column) -> Numbers:
    """Samples in their unit; NaN where the instrument had none."""
    values = np.asarray(raw * column.scale, dtype=np.float64)
    if column.type[0] == "i":
        values[raw == -(2 ** (16 * words_in(column.type) - 1))] = np.nan
    return values

"""Timing of a CAN bus: arbitration by the lowest identifier, and transmission times by frame length.

Every sender has one queue, as with one transmit mailbox: its frames keep their order, and only the first of each
queue takes part in arbitration. A frame of n bytes has 47 + 8 n bits and stuff bits. At most one stuff bit follows
every four of 34 + 8 n bits; half of the maximum is assumed. No frame is lost on this bus, frames are only delayed.
"""

from collections import deque
from itertools import chain
from operator import itemgetter
from typing import NamedTuple


class CanFrame(NamedTuple):
    """A data frame with an 11-bit identifier."""

    identifier: int
    data: bytes
    sender: object
    """Sender, which does not receive its own frame."""


def count_frame_bits(size: int) -> int:
    """Return the bits of a frame with this many data bytes, interframe space included."""
    # 47: start, identifier, control, checksum, acknowledgement, end, and three bits of interframe space.
    return 47 + 8 * size + (34 + 8 * size - 1) // 8


class BusTiming:
    """Frames that wait for the wire, and counts of transmitted ones."""

    def __init__(self, bit_rate: int = 1_000_000) -> None:
        self.frames = 0
        """Transmitted frames."""
        self.bits = 0
        """Transmitted bits."""
        self._bit_ns = 1_000_000_000 / bit_rate
        self._queues: dict[object, deque[tuple[int, CanFrame]]] = {}
        self._current: tuple[int, CanFrame] | None = None
        self._free_ns = 0

    def enqueue(self, frame: CanFrame, ready_ns: int) -> None:
        """Queue a frame from ``ready_ns`` [ns] on, after its sender's earlier frames."""
        self._queues.setdefault(frame.sender, deque()).append((ready_ns, frame))

    def pop_transmitted(self, now_ns: int) -> list[tuple[int, CanFrame]]:
        """Return the frames whose last bit was transmitted, each with that instant [ns], in order."""
        return list(iter(lambda: self.pop_next(now_ns), None))

    def pop_next(self, now_ns: int) -> tuple[int, CanFrame] | None:
        """Return the next frame whose last bit was transmitted, with that instant [ns]; None if there is none.

        A reply to it that is queued before the next call takes part in the next arbitration, however late that is.
        """
        if self._current is None:
            self._current = self._arbitrate(now_ns)
        if self._current is None or self._current[0] > now_ns:
            return None
        transmitted, self._current = self._current, None
        return transmitted

    def find_next_event(self) -> int | None:
        """Return the instant of the next event [ns]; None if no frame waits."""
        return self._find_start() if self._current is None else self._current[0]

    def find_idle_instant(self) -> int | None:
        """Return the end [ns] of all frames that follow each other without a pause; None if no frame waits."""
        end = self.find_next_event()
        if end is None:
            return None
        for ready_ns, frame in sorted(chain.from_iterable(self._queues.values()), key=itemgetter(0)):
            if ready_ns <= end:
                end += round(count_frame_bits(len(frame.data)) * self._bit_ns)
        return end

    def compute_load(self, elapsed_ns: int) -> float:
        """Return the part of ``elapsed_ns`` in which the wire was busy [1]."""
        return self.bits * self._bit_ns / elapsed_ns if elapsed_ns > 0 else 0.0

    def _find_start(self) -> int | None:
        """Return the instant at which the next frame may begin [ns]."""
        ready = [queue[0][0] for queue in self._queues.values()]
        return max(min(ready), self._free_ns) if ready else None

    def _arbitrate(self, now_ns: int) -> tuple[int, CanFrame] | None:
        """Start the next frame on the wire; return it with its end [ns]."""
        start = self._find_start()
        if start is None or start > now_ns:
            return None
        contending = [queue for queue in self._queues.values() if queue[0][0] <= start]
        queue = min(contending, key=lambda queue: queue[0][1].identifier)
        _, frame = queue.popleft()
        if not queue:
            del self._queues[frame.sender]
        bits = count_frame_bits(len(frame.data))
        self.frames += 1
        self.bits += bits
        self._free_ns = start + round(bits * self._bit_ns)
        return self._free_ns, frame

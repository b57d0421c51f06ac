"""A CAN bus as time: frames wait for the wire, the lowest identifier goes first, each takes its bits.

Every sender has one queue, as with one transmit mailbox: its own frames keep their order, and only the first of
each queue contends. A frame of n bytes has 47 + 8 n bits and some stuffed ones: none at best, one for every four
of 34 + 8 n at worst; half of that is taken here. Nothing is lost on this bus, it only becomes later.
"""

from collections import deque
from typing import NamedTuple


class CanFrame(NamedTuple):
    """A data frame with an 11-bit identifier."""

    identifier: int
    data: bytes
    sender: object
    """Whoever sent it; the frame does not come back to him."""


def frame_bits(size: int) -> int:
    """Bits on the wire of a frame with this many data bytes, interframe space included."""
    # 47: start, identifier, control, checksum, acknowledgement, end, and the three bits until the next may begin.
    return 47 + 8 * size + (34 + 8 * size - 1) // 8


class BusTiming:
    """What waits for the wire and what has passed."""

    def __init__(self, bit_rate: int = 1_000_000) -> None:
        self.frames = 0
        """Frames that passed."""
        self.bits = 0
        """Bits that passed."""
        self._bit_ns = 1_000_000_000 / bit_rate
        self._queues: dict[object, deque[tuple[int, CanFrame]]] = {}
        self._passing: tuple[int, CanFrame] | None = None
        self._free_ns = 0

    def offer(self, frame: CanFrame, ready_ns: int) -> None:
        """Let a frame wait for the wire from ``ready_ns`` [ns] on, behind its sender's earlier ones."""
        self._queues.setdefault(frame.sender, deque()).append((ready_ns, frame))

    def passed(self, now_ns: int) -> list[tuple[int, CanFrame]]:
        """The frames whose last bit has passed, each with that instant [ns], in order."""
        done: list[tuple[int, CanFrame]] = []
        while True:
            if self._passing is None:
                self._passing = self._arbitrate(now_ns)
            if self._passing is None or self._passing[0] > now_ns:
                return done
            done.append(self._passing)
            self._passing = None

    def next_ns(self) -> int | None:
        """When something happens next [ns]; none if nothing waits."""
        if self._passing is not None:
            return self._passing[0]
        return self._start_ns()

    def load(self, elapsed_ns: int) -> float:
        """Share of ``elapsed_ns`` that the wire was taken [1]."""
        return self.bits * self._bit_ns / elapsed_ns if elapsed_ns > 0 else 0.0

    def _start_ns(self) -> int | None:
        """When the next frame may begin [ns]."""
        ready = [queue[0][0] for queue in self._queues.values()]
        return max(min(ready), self._free_ns) if ready else None

    def _arbitrate(self, now_ns: int) -> tuple[int, CanFrame] | None:
        """The next frame on the wire and when it ends."""
        start = self._start_ns()
        if start is None or start > now_ns:
            return None
        contending = [queue for queue in self._queues.values() if queue[0][0] <= start]
        queue = min(contending, key=lambda queue: queue[0][1].identifier)
        _, frame = queue.popleft()
        if not queue:
            del self._queues[frame.sender]
        bits = frame_bits(len(frame.data))
        self.frames += 1
        self.bits += bits
        self._free_ns = start + round(bits * self._bit_ns)
        return self._free_ns, frame

"""Decoder of CAN frames into samples: the frames that the drive sends in reply to each SYNC.

It decodes recorded frames as it decodes live ones, so that a replay gives the same samples. The frames of one SYNC
arrive in the order of their identifiers; a sample needs all of them. Each SYNC requests one sample. Requests that
stay without a sample for a while are lost, except those that the drive's clock shows to be merely late. The
running number skips lost samples.
"""

import queue
import threading
from collections import deque
from collections.abc import Iterator, Mapping
from itertools import takewhile
from typing import Any, NamedTuple

import numpy as np

from drivers.channel import ClockReading, Frame, Quality, SampleBlock
from drivers.counters import compute_step, split_at_gaps
from drivers.transport import PdoMapping, unpack_frame

STATUSWORD, POSITION, VELOCITY, TORQUE, TIME_STAMP = 0x6041, 0x6064, 0x606C, 0x6077, 0x1013
_CHANNELS = {POSITION: "actuator_position", VELOCITY: "actuator_velocity", TORQUE: "actuator_torque"}
"""Channel of each object in a sample."""
_REPLY_TIMEOUT_NS = 100_000_000
"""Time [ns] after which a SYNC without a sample counts as lost."""
_SYNC_HISTORY = 256
"""SYNCs that are kept."""
_MAX_CLOCK_DRIFT = 1e-4
"""Rate error of the drive's clock (dimensionless) that does not count as delay."""
_CLOCK_PERIOD = 1 << 32
"""Time after which the drive's clock wraps [us]."""
_MICROSECOND = 1000
"""[ns]"""
_FRAME_NS = 108_000
"""Duration of a frame of eight bytes at 1 Mbit/s [ns], the fastest bus: no request is shorter."""
_CLOCK_REQUEST, _CLOCK_REPLY = b"\x40\x13\x10\x00", b"\x43\x13\x10\x00"
"""First bytes of an object access to the drive's clock, and of its reply."""


class CountScale(NamedTuple):
    """Size of one count of each object."""

    position: float
    """[m]"""
    velocity: float
    """[m/s]"""
    torque: float
    """[N m]"""


class _SyncTracker:
    """Counts of SYNCs whose samples are pending or lost."""

    def __init__(self, cycle: float) -> None:
        self._slack = cycle / 2 * 1e9
        self.lost = 0
        self.waiting = 0
        self._min_waiting = 0
        self._window_ns = 0
        self._syncs: deque[int] = deque(maxlen=_SYNC_HISTORY)
        self._min_transit: float | None = None
        self._last_ns: int | None = None

    def record_sync(self, now_ns: int) -> int:
        """Record a SYNC, and return how many older ones were just found to be lost."""
        lost = self._count_lost(now_ns)
        self.waiting += 1
        self._syncs.append(now_ns)
        return lost

    def record_sample(self, device_ns: int | None, now_ns: int) -> int:
        """Record a sample, and return how many others were just found to be lost."""
        self.waiting -= 1
        in_transit = 0 if device_ns is None else self._count_in_transit(device_ns, now_ns)
        self._min_waiting = min(self._min_waiting, max(self.waiting - in_transit, 0))
        return self._count_lost(now_ns)

    def snapshot(self) -> dict[str, Any]:
        """Return the state that `restore` needs."""
        return {
            "lost": self.lost,
            "waiting": self.waiting,
            "least": self._min_waiting,
            "window_ns": self._window_ns,
            "syncs": list(self._syncs),
            "soonest": self._min_transit,
            "last_ns": self._last_ns,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a snapshot."""
        self.lost, self.waiting, self._min_waiting = state["lost"], state["waiting"], state["least"]
        self._window_ns, self._min_transit, self._last_ns = state["window_ns"], state["soonest"], state["last_ns"]
        self._syncs = deque(state["syncs"], maxlen=_SYNC_HISTORY)

    def reset_clock(self) -> None:
        """Forget transit times, after the drive's clock has restarted."""
        self._min_transit = self._last_ns = None

    def _count_lost(self, now_ns: int) -> int:
        """Count SYNCs as lost that were pending during a whole reply timeout, and return their number."""
        if now_ns - self._window_ns < _REPLY_TIMEOUT_NS:
            return 0
        lost = self._min_waiting
        self.lost += lost
        self.waiting -= lost
        self._min_waiting, self._window_ns = self.waiting, now_ns
        return lost

    def _count_in_transit(self, device_ns: int, now_ns: int) -> int:
        """Return the number of SYNCs whose samples may still arrive, judged by the delay of this sample."""
        transit = float(now_ns - device_ns)
        if self._min_transit is None or self._last_ns is None:
            self._min_transit = transit
        else:
            self._min_transit = min(transit, self._min_transit + _MAX_CLOCK_DRIFT * (now_ns - self._last_ns))
        self._last_ns = now_ns
        # The time in the sample may be slightly earlier than its SYNC.
        since_ns = now_ns - (transit - self._min_transit) + self._slack
        return sum(1 for _ in takewhile(lambda sync_ns: sync_ns > since_ns, reversed(self._syncs)))


class _Sample(NamedTuple):
    number: int
    device_ns: int | None
    received_ns: int
    raw: dict[int, int]


class ActuatorDecoder:
    """Decoder of one drive's frames.

    Args:
        mappings: frames that the drive sends.
        node_id: node id on the bus.
        scale: sizes of its counts.
        origin: drive position that counts as zero [m].
        cycle: time between SYNCs [s].
    """

    def __init__(
        self,
        mappings: tuple[PdoMapping, ...],
        node_id: int,
        scale: CountScale,
        origin: float = 0.0,
        cycle: float = 0.004,
    ) -> None:
        self.received = self.corrupted = 0
        self.last_ns: int | None = None
        """Bench clock at the last sample [ns]."""
        self.statusword: int | None = None
        """Statusword in the last sample."""
        self.clock_reading: ClockReading | None = None
        """Drive's clock in the latest reply to an object access."""
        self.origin = origin
        self._request_id, self._reply_id = 0x600 + node_id, 0x580 + node_id
        self._request_ns: int | None = None
        self._mappings = {mapping.identifier: mapping for mapping in mappings if mapping.on_sync}
        self._frame_order = sorted(self._mappings)
        self._heartbeat_id = 0x700 + node_id
        self._scale = np.array([[scale.position], [scale.velocity], [scale.torque]])
        self._partial: dict[int, int] = {}
        self._next_frame = 0
        self._number = 0
        self._sync_tracker = _SyncTracker(cycle)
        self._last_frame_ns = 0
        self._clock: tuple[int, int] | None = None
        self._queue: queue.SimpleQueue[Frame] = queue.SimpleQueue()
        self._samples: list[_Sample] = []
        self._decode_lock = threading.Lock()

    @property
    def lost(self) -> int:
        """Samples that were requested but did not arrive completely."""
        return self._sync_tracker.lost

    def add_frame(self, frame: Frame) -> None:
        """Queue a frame that was sent or received. It is decoded when samples are requested.

        Decoding later keeps the thread that sends or receives the frame fast.
        """
        self._queue.put(frame)

    def snapshot(self) -> dict[str, Any]:
        """Return the state that `restore` needs to decode the frames after ``at_ns``."""
        with self._decode_lock:
            self._decode_queue()
            return {
                "at_ns": self._last_frame_ns,
                "number": self._number,
                "due": self._next_frame,
                "clock": self._clock,
                "parts": {str(index): value for index, value in self._partial.items()},
                "answers": self._sync_tracker.snapshot(),
            }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Continue from a snapshot."""
        self._number, self._next_frame = state["number"], state["due"]
        self._clock = None if state["clock"] is None else (state["clock"][0], state["clock"][1])
        self._partial = {int(index): value for index, value in state["parts"].items()}
        self._sync_tracker.restore(state["answers"])

    def pop_blocks(self) -> list[SampleBlock]:
        """Return the samples since the last call."""
        with self._decode_lock:
            self._decode_queue()
            samples, self._samples = self._samples, []
        return list(self._make_blocks(samples))

    def decode_pending(self) -> None:
        """Decode the queued frames, for callers that need counts and state but no samples."""
        with self._decode_lock:
            self._decode_queue()

    def _decode_queue(self) -> None:
        # Only the frames queued now: later ones must not hold the caller. The lock makes this thread the only
        # consumer, so `get` never waits.
        for _ in range(self._queue.qsize()):
            self._decode(self._queue.get())

    def _decode(self, frame: Frame) -> None:
        identifier, data = unpack_frame(frame.data)
        self._last_frame_ns = frame.received_ns
        if identifier == 0x80:
            self._number += self._sync_tracker.record_sync(frame.received_ns)
        elif identifier in self._mappings and not frame.sent:
            self._decode_part(identifier, data, frame.received_ns)
        elif identifier == self._request_id and data[:4] == _CLOCK_REQUEST:
            self._request_ns = frame.received_ns
        elif identifier == self._reply_id and data[:4] == _CLOCK_REPLY:
            self._record_clock(int.from_bytes(data[4:8], "little"), frame.received_ns)
        elif identifier == self._heartbeat_id and data == b"\x00":
            self._clock = None
            self._sync_tracker.reset_clock()

    def _decode_part(self, identifier: int, data: bytes, now_ns: int) -> None:
        """Decode one of the frames of a sample; a frame out of order belongs to no sample."""
        mapping = self._mappings[identifier]
        if identifier == self._frame_order[0]:
            self._next_frame, self._partial = 0, {}
        is_complete = len(data) == mapping.size
        self.corrupted += not is_complete
        if not is_complete or identifier != self._frame_order[self._next_frame]:
            self._next_frame, self._partial = 0, {}
            return
        for field in mapping.fields:
            part = data[field.offset : field.offset + field.size]
            self._partial[field.object_index] = int.from_bytes(part, "little", signed=field.signed)
        self._next_frame += 1
        if self._next_frame == len(self._frame_order):
            self._next_frame, raw, self._partial = 0, self._partial, {}
            self._complete_sample(raw, now_ns)

    def _complete_sample(self, raw: dict[int, int], now_ns: int) -> None:
        """Store a sample, unless it was counted as lost or is older than the last one."""
        if self._sync_tracker.waiting == 0 or not self._advance_clock(raw.get(TIME_STAMP)):
            return
        self.statusword, self.last_ns = raw.get(STATUSWORD), now_ns
        device_ns = self._clock[1] * _MICROSECOND if self._clock is not None else None
        self._samples.append(_Sample(self._number, device_ns, now_ns, raw))
        self.received += 1
        self._number += 1 + self._sync_tracker.record_sample(device_ns, now_ns)

    def _record_clock(self, clock: int, now_ns: int) -> None:
        """Record the drive's clock, which was read between request and reply.

        The time in a sample is not a clock reading: it is that of the position, which is older.
        """
        if self._request_ns is None:
            return
        last, total = self._clock if self._clock is not None else (clock, clock)
        device_ns = (total + compute_step(clock, last, _CLOCK_PERIOD)) * _MICROSECOND
        earliest = min(self._request_ns + _FRAME_NS, now_ns)
        self.clock_reading = ClockReading(device_ns, earliest, max(now_ns - _FRAME_NS, earliest))
        self._request_ns = None

    def _advance_clock(self, clock: int | None) -> bool:
        """Remove the wraps of the drive's clock, and return False if it went backwards."""
        if clock is None:
            return True
        last, total = self._clock if self._clock is not None else (clock, clock)
        step = (clock - last) % _CLOCK_PERIOD
        if step > _CLOCK_PERIOD // 2:
            return False
        self._clock = clock, total + step
        return True

    def _make_blocks(self, samples: list[_Sample]) -> Iterator[SampleBlock]:
        """Yield the three channels of every stretch without gap."""
        for stretch in split_at_gaps(samples):
            times = [sample.device_ns for sample in stretch if sample.device_ns is not None]
            device_ns = np.array(times, dtype=np.int64) if times else None
            raw = np.array([[sample.raw[index] for sample in stretch] for index in _CHANNELS], dtype=np.float64)
            values = raw * self._scale - [[self.origin], [0.0], [0.0]]
            first, received_ns = stretch[0].number, stretch[-1].received_ns
            quality: Quality = "good" if times else "uncertain"
            for channel, channel_values, counts in zip(_CHANNELS.values(), values, raw, strict=True):
                yield SampleBlock(channel, first, device_ns, received_ns, channel_values, counts, quality)

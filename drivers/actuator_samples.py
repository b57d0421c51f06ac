"""From frames to samples: what the drive sent in answer to each SYNC.

Works on recorded frames as on live ones, so that a replay gives the same samples. The frames of one SYNC come in
the order of their identifiers; a sample is used only when all of them are there. Each SYNC asks for one sample: as
many as stay unanswered for a while, beyond what the drive's clock shows to be merely late, are lost, and the
running number leaps over them.
"""

import queue
import threading
from collections import deque
from collections.abc import Iterator, Mapping
from itertools import groupby, takewhile
from typing import Any, NamedTuple

import numpy as np

from drivers.can_bus import unpack_frame
from drivers.canopen_layout import PdoLayout
from drivers.channel import Block, Frame, Quality, Stamp

STATUSWORD, POSITION, VELOCITY, TORQUE, TIME_STAMP = 0x6041, 0x6064, 0x606C, 0x6077, 0x1013
_CHANNELS = {POSITION: "actuator_position", VELOCITY: "actuator_velocity", TORQUE: "actuator_torque"}
"""Channel of each object that a sample holds."""
_PATIENCE_NS = 100_000_000
"""A SYNC unanswered for this long never will be."""
_REMEMBERED = 256
"""SYNCs"""
_DRIFT = 1e-4
"""Share by which the drive's clock may be slow without looking late."""
_WRAP = 1 << 32
"""[us] in one turn of the drive's clock."""
_MICROSECOND = 1000
"""[ns]"""
_FRAME_NS = 108_000
"""[ns] that a frame of eight bytes is on a bus of 1 Mbit/s, the fastest there is: no question is quicker."""
_CLOCK_WANTED, _CLOCK_COMES = b"\x40\x13\x10\x00", b"\x43\x13\x10\x00"
"""How an object access for the drive's clock begins, and its answer."""


class Scale(NamedTuple):
    """What one count of each object is."""

    position: float
    """[m]"""
    velocity: float
    """[m/s]"""
    torque: float
    """[N m]"""


class _Answers:
    """How many SYNCs are unanswered, and how many of them for good."""

    def __init__(self, cycle: float) -> None:
        self._slack = cycle / 2 * 1e9
        self.lost = 0
        self.waiting = 0
        self._least = 0
        self._window_ns = 0
        self._syncs: deque[int] = deque(maxlen=_REMEMBERED)
        self._soonest: float | None = None
        self._last_ns: int | None = None

    def asked(self, now_ns: int) -> int:
        """One more sample is to come; how many older ones are lost, as just found."""
        gone = self._settle(now_ns)
        self.waiting += 1
        self._syncs.append(now_ns)
        return gone

    def answered(self, device_ns: int | None, now_ns: int) -> int:
        """A sample came; how many others are lost, as just found."""
        self.waiting -= 1
        on_their_way = 0 if device_ns is None else self._on_their_way(device_ns, now_ns)
        self._least = min(self._least, max(self.waiting - on_their_way, 0))
        return self._settle(now_ns)

    def state(self) -> dict[str, Any]:
        """What `resume` needs to go on from here."""
        return {
            "lost": self.lost, "waiting": self.waiting, "least": self._least, "window_ns": self._window_ns,
            "syncs": list(self._syncs), "soonest": self._soonest, "last_ns": self._last_ns,
        }  # fmt: skip

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on from a `state`."""
        self.lost, self.waiting, self._least = state["lost"], state["waiting"], state["least"]
        self._window_ns, self._soonest, self._last_ns = state["window_ns"], state["soonest"], state["last_ns"]
        self._syncs = deque(state["syncs"], maxlen=_REMEMBERED)

    def restarted(self) -> None:
        """The drive's clock begins anew."""
        self._soonest = self._last_ns = None

    def _settle(self, now_ns: int) -> int:
        """What stayed unanswered throughout a while is lost."""
        if now_ns - self._window_ns < _PATIENCE_NS:
            return 0
        gone = self._least
        self.lost += gone
        self.waiting -= gone
        self._least, self._window_ns = self.waiting, now_ns
        return gone

    def _on_their_way(self, device_ns: int, now_ns: int) -> int:
        """SYNCs whose samples may still be coming, judged by how late this one is."""
        transit = float(now_ns - device_ns)
        if self._soonest is None or self._last_ns is None:
            self._soonest = transit
        else:
            self._soonest = min(transit, self._soonest + _DRIFT * (now_ns - self._last_ns))
        self._last_ns = now_ns
        # The drive's stamp may be somewhat older than the SYNC that it answers.
        asked_since = now_ns - (transit - self._soonest) + self._slack
        return sum(1 for _ in takewhile(lambda sync: sync > asked_since, reversed(self._syncs)))


class _Sample(NamedTuple):
    number: int
    device_ns: int | None
    received_ns: int
    raw: dict[int, int]


class ActuatorSamples:
    """Collects the samples of one drive.

    Args:
        layouts: the frames that it sends.
        node_id: on the bus.
        scale: of its counts.
        origin: [m] drive position that counts as zero.
        cycle: [s] between SYNCs.
    """

    def __init__(
        self, layouts: tuple[PdoLayout, ...], node_id: int, scale: Scale, origin: float = 0.0, cycle: float = 0.004
    ) -> None:
        self.received = self.corrupted = 0
        self.last_ns: int | None = None
        """Bench clock of the last sample [ns]."""
        self.statusword: int | None = None
        """Of the last sample."""
        self.stamp: Stamp | None = None
        """The drive's clock beside the bench's, from the newest answer to the question for it."""
        self.origin = origin
        self._asks, self._answers_with = 0x600 + node_id, 0x580 + node_id
        self._asked_ns: int | None = None
        self._layouts = {layout.identifier: layout for layout in layouts if layout.on_sync}
        self._order = sorted(self._layouts)
        self._boot = 0x700 + node_id
        self._count = np.array([[scale.position], [scale.velocity], [scale.torque]])
        self._parts: dict[int, int] = {}
        self._due = 0
        self._number = 0
        self._answers = _Answers(cycle)
        self._seen_ns = 0
        self._clock: tuple[int, int] | None = None
        self._passed: queue.SimpleQueue[Frame] = queue.SimpleQueue()
        self._ready: list[_Sample] = []
        self._decoding = threading.Lock()

    @property
    def lost(self) -> int:
        """Samples that were asked for and never came whole."""
        return self._answers.lost

    def take(self, frame: Frame) -> None:
        """A frame has passed, sent or received; it is decoded when samples are asked for.

        Whoever sends or receives it is in more of a hurry than whoever wants its samples.
        """
        self._passed.put(frame)

    def state(self) -> dict[str, Any]:
        """Where it stands: what `resume` needs to go on with the frames after ``at_ns`` as this one does."""
        with self._decoding:
            self._decode_passed()
            return {
                "at_ns": self._seen_ns, "number": self._number, "due": self._due, "clock": self._clock,
                "parts": {str(entry): value for entry, value in self._parts.items()},
                "answers": self._answers.state(),
            }  # fmt: skip

    def resume(self, state: Mapping[str, Any]) -> None:
        """Go on from a `state`."""
        self._number, self._due = state["number"], state["due"]
        self._clock = None if state["clock"] is None else (state["clock"][0], state["clock"][1])
        self._parts = {int(entry): value for entry, value in state["parts"].items()}
        self._answers.resume(state["answers"])

    def blocks(self) -> list[Block]:
        """The samples since the last call."""
        with self._decoding:
            self._decode_passed()
            samples, self._ready = self._ready, []
        return list(self._blocks_of(samples))

    def catch_up(self) -> None:
        """Decode what has passed, for whoever wants to know how things stand and not the samples."""
        with self._decoding:
            self._decode_passed()

    def _decode_passed(self) -> None:
        # What is there now, and no more: frames that come meanwhile must not keep the caller.
        # Nobody else takes any under the lock, so that `get` never waits.
        for _ in range(self._passed.qsize()):
            self._decode(self._passed.get())

    def _decode(self, frame: Frame) -> None:
        identifier, data = unpack_frame(frame.data)
        self._seen_ns = frame.received_ns
        if identifier == 0x80:
            self._number += self._answers.asked(frame.received_ns)
        elif identifier in self._layouts and not frame.sent:
            self._part(identifier, data, frame.received_ns)
        elif identifier == self._asks and data[:4] == _CLOCK_WANTED:
            self._asked_ns = frame.received_ns
        elif identifier == self._answers_with and data[:4] == _CLOCK_COMES:
            self._stamped(int.from_bytes(data[4:8], "little"), frame.received_ns)
        elif identifier == self._boot and data == b"\x00":
            self._clock = None
            self._answers.restarted()

    def _part(self, identifier: int, data: bytes, now_ns: int) -> None:
        """One of the frames that make a sample; out of turn, it belongs to none."""
        layout = self._layouts[identifier]
        if identifier == self._order[0]:
            self._due, self._parts = 0, {}
        whole = len(data) == layout.size
        self.corrupted += not whole
        if not whole or identifier != self._order[self._due]:
            self._due, self._parts = 0, {}
            return
        for field in layout.fields:
            part = data[field.start : field.start + field.size]
            self._parts[field.entry] = int.from_bytes(part, "little", signed=field.signed)
        self._due += 1
        if self._due == len(self._order):
            self._due, raw, self._parts = 0, self._parts, {}
            self._complete(raw, now_ns)

    def _complete(self, raw: dict[int, int], now_ns: int) -> None:
        """All frames are there; a sample that was given up, or is older than the last, is not used."""
        if self._answers.waiting == 0 or not self._advance_clock(raw.get(TIME_STAMP)):
            return
        self.statusword, self.last_ns = raw.get(STATUSWORD), now_ns
        device_ns = self._clock[1] * _MICROSECOND if self._clock is not None else None
        self._ready.append(_Sample(self._number, device_ns, now_ns, raw))
        self.received += 1
        self._number += 1 + self._answers.answered(device_ns, now_ns)

    def _stamped(self, clock: int, now_ns: int) -> None:
        """Its clock was read between question and answer; a sample's stamp is of its position, which is older."""
        if self._asked_ns is None:
            return
        last, total = self._clock if self._clock is not None else (clock, clock)
        turned = (clock - last + _WRAP // 2) % _WRAP - _WRAP // 2
        earliest = min(self._asked_ns + _FRAME_NS, now_ns)
        self.stamp = Stamp((total + turned) * _MICROSECOND, earliest, max(now_ns - _FRAME_NS, earliest))
        self._asked_ns = None

    def _advance_clock(self, stamp: int | None) -> bool:
        """Undo the wrapping of the drive's clock; false if it went backwards."""
        if stamp is None:
            return True
        last, total = self._clock if self._clock is not None else (stamp, stamp)
        step = (stamp - last) % _WRAP
        if step > _WRAP // 2:
            return False
        self._clock = stamp, total + step
        return True

    def _blocks_of(self, samples: list[_Sample]) -> Iterator[Block]:
        """The three channels of every stretch without gap."""
        # Number less place stays the same for as long as none is missing.
        for _, group in groupby(enumerate(samples), lambda it: it[1].number - it[0]):
            stretch = [sample for _, sample in group]
            stamped = [sample.device_ns for sample in stretch if sample.device_ns is not None]
            device_ns = np.array(stamped, dtype=np.int64) if stamped else None
            raw = np.array([[sample.raw[entry] for sample in stretch] for entry in _CHANNELS], dtype=np.float64)
            values = raw * self._count - [[self.origin], [0.0], [0.0]]
            first, received_ns = stretch[0].number, stretch[-1].received_ns
            quality: Quality = "good" if stamped else "uncertain"
            for channel, own, counts in zip(_CHANNELS.values(), values, raw, strict=True):
                yield Block(channel, first, device_ns, received_ns, own, counts, quality)

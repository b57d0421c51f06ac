"""A CANopen slave, written by hand: network management, process data, heartbeats, emergencies.

What the device does with its objects is not known here: a `Device` is asked before an object is read, after one
was written, at each SYNC, and when the master's heartbeat has gone. Frames come and go as (identifier, bytes);
time is an argument.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from sim_rig.object_dictionary import Abort, ObjectDictionary
from sim_rig.sdo_server import SdoServer

Send = Callable[[int, bytes, int], None]
"""Puts a frame on the bus: identifier, data, not before [ns]."""

PRE_OPERATIONAL, OPERATIONAL, STOPPED = 127, 5, 4
_COMMANDS = {1: OPERATIONAL, 2: STOPPED, 128: PRE_OPERATIONAL}
_NOT_VALID = 1 << 31
"""Of an identifier: its process data are not in use."""
_EVENT_DRIVEN = 254
"""Least transmission type of what does not wait for a SYNC."""
_MILLISECOND = 1_000_000
"""[ns]"""


class Device(Protocol):
    """What stands behind the objects."""

    def refresh(self, now_ns: int) -> None:
        """Bring the actual values up to date."""

    def asked(self, index: int, now_ns: int) -> None:
        """An object is about to be read by a client, the actual values being up to date."""

    def written(self, index: int, sub: int, now_ns: int) -> None:
        """An object was written by a client or by process data."""

    def synchronised(self, now_ns: int) -> None:
        """Process data took effect at a SYNC; called with what was received applied."""

    def master_lost(self, now_ns: int) -> None:
        """The watched heartbeat has gone."""

    def reset(self, now_ns: int) -> None:
        """The node was told to start anew."""


@dataclass
class Injection:
    """Faults for tests to inject."""

    silent: bool = False
    """Neither answers nor sends."""
    late_ns: int = 0
    """Delay of every process datum [ns]."""
    dropped: int = 0
    """Process data frames still to be swallowed."""
    corrupt_sdo: int = 0
    """Answers still to be given for another object than asked for."""
    late_sdo_ns: int = 0
    """Delay of every answer [ns]."""
    short_pdo: int = 0
    """Process data frames still to be cut short."""


class CanopenSlave:
    """One node."""

    def __init__(self, node_id: int, objects: ObjectDictionary, device: Device, send: Send) -> None:
        self.node_id = node_id
        self.objects = objects
        self.state = 0
        self.injection = Injection()
        self._device = device
        self._put = send
        self._sdo = SdoServer(objects, self._asked, self._written)
        self._staged: dict[int, bytes] = {}
        self._events: dict[int, bytes] = {}
        self._next_heartbeat_ns = 0
        self._master_seen_ns: int | None = None

    def boot(self, now_ns: int) -> None:
        """Announce the node; it becomes pre-operational."""
        self.state = PRE_OPERATIONAL
        self._sdo.forget()
        self._master_seen_ns = None
        self._send(0x700 + self.node_id, b"\x00", now_ns)
        self._next_heartbeat_ns = now_ns + self._heartbeat_period()

    def take(self, identifier: int, data: bytes, now_ns: int) -> None:
        """A frame of somebody else."""
        if identifier == 0x000 and len(data) >= 2 and data[1] in (0, self.node_id):
            self._network_command(data[0], now_ns)
        elif identifier == self.objects.number(0x1005) & 0x7FF:
            self._sync(now_ns)
        elif identifier == 0x600 + self.node_id and self.state != STOPPED:
            self._object_request(data, now_ns)
        elif 0x700 < identifier <= 0x77F:
            self._heard(identifier - 0x700, now_ns)
        else:
            self._process_data(identifier, data, now_ns)

    def tick(self, now_ns: int) -> None:
        """Heartbeats, events, watchdog."""
        period = self._heartbeat_period()
        if period and now_ns >= self._next_heartbeat_ns:
            # On a beat of its own, but no burst after a pause.
            self._next_heartbeat_ns = max(self._next_heartbeat_ns + period, now_ns)
            self._send(0x700 + self.node_id, bytes([self.state]), now_ns)
        watched = self.objects.number(0x1016, 1) & 0xFFFF
        seen = self._master_seen_ns
        if watched and seen is not None and now_ns - seen > watched * _MILLISECOND:
            self._master_seen_ns = None
            # Told once: the watch begins anew with the next heartbeat.
            self._device.master_lost(now_ns)
        if self.state == OPERATIONAL:
            self._send_events(now_ns)

    def emergency(self, code: int, register: int, now_ns: int) -> None:
        """Tell everybody of a fault, or with code 0 that none is left."""
        self.objects.put(0x1001, register)
        if code:
            past = [self.objects.number(0x1003, sub) for sub in range(1, 4)]
            for sub, value in enumerate([code, *past], start=1):
                self.objects.put(0x1003, value, sub)
            self.objects.put(0x1003, min(self.objects.number(0x1003) + 1, 4))
        self._send(0x80 + self.node_id, struct.pack("<HB5x", code, register), now_ns)

    def _network_command(self, command: int, now_ns: int) -> None:
        if command in _COMMANDS:
            self.state = _COMMANDS[command]
            # What is sent on change is sent once when the node becomes operational, changed or not.
            self._events.clear()
        elif command in (129, 130):
            self._device.reset(now_ns)
            self.boot(now_ns)

    def _heard(self, node: int, now_ns: int) -> None:
        watched = self.objects.number(0x1016, 1)
        if watched & 0xFFFF and node == (watched >> 16) & 0x7F:
            self._master_seen_ns = now_ns

    def _heartbeat_period(self) -> int:
        return self.objects.number(0x1017) * _MILLISECOND

    # Process data

    def _process_data(self, identifier: int, data: bytes, now_ns: int) -> None:
        if self.state != OPERATIONAL or not _is_pdo(self.objects, 0x1400, identifier):
            return
        if len(data) < sum(bits for _, _, bits in _mapping(self.objects, 0x1600)) // 8:
            # Of CiA 301: process data too short; in the register, communication.
            self.emergency(0x8210, 0x10, now_ns)
        elif self.objects.number(0x1400, 2) < _EVENT_DRIVEN:
            # Synchronous process data come into force with the next SYNC.
            self._staged[0x1600] = data
        else:
            self._unpack(0x1600, data, now_ns)

    def _sync(self, now_ns: int) -> None:
        if self.state != OPERATIONAL:
            return
        for mapping, data in self._staged.items():
            self._unpack(mapping, data, now_ns)
        self._staged.clear()
        self._device.refresh(now_ns)
        for number in (0x1800, 0x1801, 0x1802):
            if self.objects.number(number, 2) < _EVENT_DRIVEN:
                self._send_pdo(number, self._pack(number + 0x200), now_ns)

    def _unpack(self, mapping: int, data: bytes, now_ns: int) -> None:
        at = 0
        for index, sub, bits in _mapping(self.objects, mapping):
            part = data[at : at + bits // 8]
            at += bits // 8
            try:
                self.objects.download(index, sub, part)
            except Abort:
                # Of CiA 301: a protocol error; in the register, communication.
                self.emergency(0x8200, 0x10, now_ns)
                return
        self._device.synchronised(now_ns)

    def _pack(self, mapping: int) -> bytes:
        return b"".join(self.objects.upload(index, sub) for index, sub, _ in _mapping(self.objects, mapping))

    def _send_events(self, now_ns: int) -> None:
        for number in (0x1800, 0x1801, 0x1802):
            if self.objects.number(number, 2) >= _EVENT_DRIVEN:
                data = self._pack(number + 0x200)
                if data != self._events.get(number):
                    self._events[number] = data
                    self._send_pdo(number, data, now_ns)

    def _send_pdo(self, number: int, data: bytes, now_ns: int) -> None:
        cob = self.objects.number(number, 1)
        if cob & _NOT_VALID or not data:
            return
        if self.injection.dropped > 0:
            self.injection.dropped -= 1
            return
        if self.injection.short_pdo > 0:
            self.injection.short_pdo -= 1
            data = data[:-1]
        self._send(cob & 0x7FF, data, now_ns + self.injection.late_ns)

    # Object access

    def _object_request(self, data: bytes, now_ns: int) -> None:
        if len(data) != 8:
            return
        answer = self._sdo.respond(data, now_ns)
        if answer is None:
            return
        if self.injection.corrupt_sdo > 0:
            self.injection.corrupt_sdo -= 1
            answer = bytes([answer[0], answer[1] ^ 0xFF]) + answer[2:]
        self._send(0x580 + self.node_id, answer, now_ns + self.injection.late_sdo_ns)

    def _asked(self, index: int, now_ns: int) -> None:
        self._device.refresh(now_ns)
        self._device.asked(index, now_ns)

    def _written(self, index: int, sub: int, now_ns: int) -> None:
        if index == 0x1016:  # the watch begins with the first heartbeat after it was set
            self._master_seen_ns = None
        self._device.written(index, sub, now_ns)

    def _send(self, identifier: int, data: bytes, not_before_ns: int) -> None:
        if not self.injection.silent:
            self._put(identifier, data, not_before_ns)


def _is_pdo(objects: ObjectDictionary, number: int, identifier: int) -> bool:
    cob = objects.number(number, 1)
    return not cob & _NOT_VALID and cob & 0x7FF == identifier


def _mapping(objects: ObjectDictionary, number: int) -> list[tuple[int, int, int]]:
    """Index, sub-index and bits of what a process data frame carries."""
    # Index, sub-index and length in bits stand in one number: 16, 8 and 8 of its bits.
    words = [objects.number(number, sub) for sub in range(1, objects.number(number) + 1)]
    return [(word >> 16, word >> 8 & 0xFF, word & 0xFF) for word in words]

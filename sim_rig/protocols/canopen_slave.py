"""CANopen slave: network management, process data, heartbeats, emergencies.

The slave is independent of its device: a `CanopenDevice` is called before an object is read, after one was
written, at each SYNC, and when the master's heartbeat is lost. Frames are pairs of identifier and bytes; time is
an argument. It does not use the CANopen library of the drivers, so that an error there does not cancel out here.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from sim_rig.protocols.object_dictionary import ObjectDictionary, SdoAbortError
from sim_rig.protocols.sdo_server import SdoServer

SendFrame = Callable[[int, bytes, int], None]
"""Function that sends a frame: identifier, data, earliest instant [ns]."""

PRE_OPERATIONAL, OPERATIONAL, STOPPED = 127, 5, 4
_COMMANDS = {1: OPERATIONAL, 2: STOPPED, 128: PRE_OPERATIONAL}
_COB_DISABLED = 1 << 31
"""Bit of a COB identifier: the process data object is disabled."""
_EVENT_DRIVEN = 254
"""Lowest transmission type that does not wait for a SYNC."""
_MILLISECOND = 1_000_000
"""[ns]"""


class CanopenDevice(Protocol):
    """The device behind the objects."""

    def update_objects(self, now_ns: int) -> None:
        """Bring the actual values up to date."""

    def on_read(self, index: int, now_ns: int) -> None:
        """Handle that a client is about to read an object; the actual values are up to date."""

    def on_write(self, index: int, sub: int, now_ns: int) -> None:
        """Handle that a client or process data wrote an object."""

    def on_sync(self, now_ns: int) -> None:
        """Handle received process data, after they were applied at a SYNC."""

    def on_master_lost(self, now_ns: int) -> None:
        """Handle the loss of the monitored heartbeat."""

    def reset(self, now_ns: int) -> None:
        """Handle a reset command of the network management."""


@dataclass
class FaultInjection:
    """Faults for tests to inject."""

    silent: bool = False
    """While true, the node neither replies nor sends."""
    pdo_delay_ns: int = 0
    """Delay of every process data frame [ns]."""
    dropped_pdos: int = 0
    """Number of process data frames still to be dropped."""
    corrupted_sdos: int = 0
    """Number of SDO replies still to name a wrong object."""
    sdo_delay_ns: int = 0
    """Delay of every SDO reply [ns]."""
    shortened_pdos: int = 0
    """Number of process data frames still to be shortened."""


class CanopenSlave:
    """One node of the bus."""

    def __init__(self, node_id: int, objects: ObjectDictionary, device: CanopenDevice, send: SendFrame) -> None:
        self.node_id = node_id
        self.objects = objects
        self.state = 0
        self.injection = FaultInjection()
        self._device = device
        self._send_frame = send
        self._sdo = SdoServer(objects, self._on_read, self._on_write)
        self._staged: dict[int, bytes] = {}
        self._events: dict[int, bytes] = {}
        self._next_heartbeat_ns = 0
        self._master_seen_ns: int | None = None

    def boot(self, now_ns: int) -> None:
        """Announce the node and enter the pre-operational state."""
        self.state = PRE_OPERATIONAL
        self._sdo.reset()
        self._master_seen_ns = None
        self._send(0x700 + self.node_id, b"\x00", now_ns)
        self._next_heartbeat_ns = now_ns + self._get_heartbeat_period()

    def receive(self, identifier: int, data: bytes, now_ns: int) -> None:
        """Process a frame of another node."""
        if identifier == 0x000 and len(data) >= 2 and data[1] in (0, self.node_id):
            self._handle_nmt(data[0], now_ns)
        elif identifier == self.objects.get_number(0x1005) & 0x7FF:
            self._handle_sync(now_ns)
        elif identifier == 0x600 + self.node_id and self.state != STOPPED:
            self._handle_sdo(data, now_ns)
        elif 0x700 < identifier <= 0x77F:
            self._on_heartbeat(identifier - 0x700, now_ns)
        else:
            self._handle_pdo(identifier, data, now_ns)

    def tick(self, now_ns: int) -> None:
        """Send heartbeats and events, and monitor the master."""
        period = self._get_heartbeat_period()
        if period and now_ns >= self._next_heartbeat_ns:
            # At fixed instants, but without a burst after a pause.
            self._next_heartbeat_ns = max(self._next_heartbeat_ns + period, now_ns)
            self._send(0x700 + self.node_id, bytes([self.state]), now_ns)
        watched = self.objects.get_number(0x1016, 1) & 0xFFFF
        seen = self._master_seen_ns
        if watched and seen is not None and now_ns - seen > watched * _MILLISECOND:
            self._master_seen_ns = None
            # Reported once: monitoring restarts with the next heartbeat.
            self._device.on_master_lost(now_ns)
        if self.state == OPERATIONAL:
            self._send_events(now_ns)

    def send_emergency(self, code: int, register: int, now_ns: int) -> None:
        """Send an emergency for a fault; code 0 means that no fault is left."""
        self.objects.set_value(0x1001, register)
        if code:
            history = [self.objects.get_number(0x1003, sub) for sub in range(1, 4)]
            for sub, value in enumerate([code, *history], start=1):
                self.objects.set_value(0x1003, value, sub)
            self.objects.set_value(0x1003, min(self.objects.get_number(0x1003) + 1, 4))
        self._send(0x80 + self.node_id, struct.pack("<HB5x", code, register), now_ns)

    def _handle_nmt(self, command: int, now_ns: int) -> None:
        if command in _COMMANDS:
            self.state = _COMMANDS[command]
            # Event-driven data are sent once when the node becomes operational, changed or not.
            self._events.clear()
        elif command in (129, 130):
            self._device.reset(now_ns)
            self.boot(now_ns)

    def _on_heartbeat(self, node: int, now_ns: int) -> None:
        watched = self.objects.get_number(0x1016, 1)
        if watched & 0xFFFF and node == (watched >> 16) & 0x7F:
            self._master_seen_ns = now_ns

    def _get_heartbeat_period(self) -> int:
        return self.objects.get_number(0x1017) * _MILLISECOND

    # Process data

    def _handle_pdo(self, identifier: int, data: bytes, now_ns: int) -> None:
        if self.state != OPERATIONAL or not _is_pdo(self.objects, 0x1400, identifier):
            return
        if len(data) < sum(bits for _, _, bits in _read_mapping(self.objects, 0x1600)) // 8:
            # CiA 301: PDO too short (8210h), error register communication (10h).
            self.send_emergency(0x8210, 0x10, now_ns)
        elif self.objects.get_number(0x1400, 2) < _EVENT_DRIVEN:
            # Synchronous process data take effect at the next SYNC.
            self._staged[0x1600] = data
        else:
            self._unpack(0x1600, data, now_ns)

    def _handle_sync(self, now_ns: int) -> None:
        if self.state != OPERATIONAL:
            return
        for mapping, data in self._staged.items():
            self._unpack(mapping, data, now_ns)
        self._staged.clear()
        self._device.update_objects(now_ns)
        for number in (0x1800, 0x1801, 0x1802):
            if self.objects.get_number(number, 2) < _EVENT_DRIVEN:
                self._send_pdo(number, self._pack(number + 0x200), now_ns)

    def _unpack(self, mapping: int, data: bytes, now_ns: int) -> None:
        offset = 0
        for index, sub, bits in _read_mapping(self.objects, mapping):
            part = data[offset : offset + bits // 8]
            offset += bits // 8
            try:
                self.objects.download(index, sub, part)
            except SdoAbortError:
                # CiA 301: protocol error (8200h), error register communication (10h).
                self.send_emergency(0x8200, 0x10, now_ns)
                return
        self._device.on_sync(now_ns)

    def _pack(self, mapping: int) -> bytes:
        return b"".join(self.objects.upload(index, sub) for index, sub, _ in _read_mapping(self.objects, mapping))

    def _send_events(self, now_ns: int) -> None:
        for number in (0x1800, 0x1801, 0x1802):
            if self.objects.get_number(number, 2) >= _EVENT_DRIVEN:
                data = self._pack(number + 0x200)
                if data != self._events.get(number):
                    self._events[number] = data
                    self._send_pdo(number, data, now_ns)

    def _send_pdo(self, number: int, data: bytes, now_ns: int) -> None:
        cob = self.objects.get_number(number, 1)
        if cob & _COB_DISABLED or not data:
            return
        if self.injection.dropped_pdos > 0:
            self.injection.dropped_pdos -= 1
            return
        if self.injection.shortened_pdos > 0:
            self.injection.shortened_pdos -= 1
            data = data[:-1]
        self._send(cob & 0x7FF, data, now_ns + self.injection.pdo_delay_ns)

    # Object access

    def _handle_sdo(self, data: bytes, now_ns: int) -> None:
        if len(data) != 8:
            return
        reply = self._sdo.respond(data, now_ns)
        if reply is None:
            return
        if self.injection.corrupted_sdos > 0:
            self.injection.corrupted_sdos -= 1
            reply = bytes([reply[0], reply[1] ^ 0xFF]) + reply[2:]
        self._send(0x580 + self.node_id, reply, now_ns + self.injection.sdo_delay_ns)

    def _on_read(self, index: int, now_ns: int) -> None:
        self._device.update_objects(now_ns)
        self._device.on_read(index, now_ns)

    def _on_write(self, index: int, sub: int, now_ns: int) -> None:
        if index == 0x1016:  # monitoring begins with the first heartbeat after it was configured
            self._master_seen_ns = None
        self._device.on_write(index, sub, now_ns)

    def _send(self, identifier: int, data: bytes, not_before_ns: int) -> None:
        if not self.injection.silent:
            self._send_frame(identifier, data, not_before_ns)


def _is_pdo(objects: ObjectDictionary, number: int, identifier: int) -> bool:
    cob = objects.get_number(number, 1)
    return not cob & _COB_DISABLED and cob & 0x7FF == identifier


def _read_mapping(objects: ObjectDictionary, number: int) -> list[tuple[int, int, int]]:
    """Return index, sub-index and length in bits of each object in a process data frame."""
    # One number contains index, sub-index and length: 16, 8 and 8 bits.
    words = [objects.get_number(number, sub) for sub in range(1, objects.get_number(number) + 1)]
    return [(word >> 16, word >> 8 & 0xFF, word & 0xFF) for word in words]

"""One CANopen node: objects, process data and emergencies; `canopen_heartbeat` monitors its state.

The `canopen` library provides object dictionary, object access and the layout of process data. It reports
timeouts, invalid replies and refusals by one class of error; this module distinguishes them. After a timeout it
waits once more for the late reply before the next request, so that the late reply is not taken for the reply to
that request.
"""

import contextlib
import logging
import queue
import struct
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import can
import canopen

from drivers.errors import InvalidReplyError, NoReplyError, NotConnectedError, OutOfRangeError, RefusedError
from drivers.instrument import Clock
from drivers.transport.can_bus import CanBus
from drivers.transport.canopen_heartbeat import HeartbeatConsumer
from drivers.transport.canopen_pdo import read_mapping

# Errors are raised or counted here; without a handler the library writes them to standard error as well.
logging.getLogger("canopen").addHandler(logging.NullHandler())

# The library raises one class for timeouts and for invalid replies; its text distinguishes them.
_TIMEOUT_MESSAGE = "No SDO response received"
_EMERGENCY = struct.Struct("<HB5s")
_MAX_EMERGENCIES = 1000
"""Emergencies that are kept."""
_SYNC_FRAME = (0x80, b"")

_Result = TypeVar("_Result")


class Emergency(NamedTuple):
    """An emergency message of the node (CiA 301)."""

    code: int
    """Error code of CiA 301 and of the device profile; 0: no fault remains."""
    register: int
    received_ns: int
    """Bench clock [ns]."""


class _Network(canopen.Network):
    """The library's network, sending on a `CanBus`."""

    def __init__(self, bus: CanBus) -> None:
        super().__init__()
        self._can_bus = bus

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        self._can_bus.send(can_id, bytes(data))


class CanopenNode:
    """A node as seen by its master.

    Args:
        name: name of the instrument, for messages.
        bus: CAN bus, open or opened later.
        node_id: node id on the bus.
        eds: electronic data sheet of the node.
        clock: bench clock [ns].
        sdo_timeout: time limit of one object access [s].
        heartbeat_timeout: time without a heartbeat after which the node counts as lost [s].
    """

    def __init__(
        self,
        name: str,
        bus: CanBus,
        node_id: int,
        eds: Path,
        clock: Clock,
        *,
        sdo_timeout: float = 0.3,
        heartbeat_timeout: float = 0.25,
    ) -> None:
        self.node_id = node_id
        self.emergencies: list[Emergency] = []
        """Latest emergencies, oldest first."""
        self.heartbeat = HeartbeatConsumer(name, bus, clock, heartbeat_timeout)
        self._name = name
        self._bus = bus
        self._network = _Network(bus)
        self._node = canopen.RemoteNode(node_id, str(eds))
        self._sdo_timeout = self._node.sdo.RESPONSE_TIMEOUT = sdo_timeout
        self._network.add_node(self._node)
        maps: Any = self._node.pdo
        # From the data sheet, not from the node, which need not be on the bus yet.
        maps.read(from_od=True)
        self.mappings = tuple(read_mapping(pdo) for pdo in self._node.tpdo.values())
        """Frames that the node sends, as its data sheet maps them."""
        # Packed and sent here: the library (2.4.1) sends synchronous PDOs by a timer of its own.
        self._setpoint_mapping = read_mapping(self._node.rpdo[1])
        self._setpoint_values: dict[int, int] = {}
        self._sdo_lock = threading.Lock()
        self._reply_pending = False

    def attach(self) -> None:
        """Begin to receive on the bus."""
        self.heartbeat.reset()
        self._reply_pending = False
        self._bus.unsubscribe(self._on_frame)  # otherwise each connection would add another subscription
        self._bus.subscribe(self._on_frame)

    def command_state(self, state: int, timeout: float) -> None:
        """Send a network command and wait until a heartbeat confirms it.

        Args:
            state: 5 operational, 4 stopped, 127 pre-operational.
            timeout: deadline [s].

        Raises:
            NoReplyError: it was not confirmed in time.
        """
        # Commands of CiA 301: 1 start, 2 stop, 128 enter pre-operational.
        self._bus.send(0x000, bytes([{5: 1, 4: 2, 127: 128}[state], self.node_id]))
        self.heartbeat.wait_for_state(state, timeout)

    def upload(self, index: int, sub: int = 0) -> int | str:
        """Read an object, in the unit of the wire.

        Raises:
            NoReplyError, InvalidReplyError, RefusedError, NotConnectedError: the object was not read.
        """
        value = self._access_object(
            f"reading {_format_object(index, sub)}", lambda: self._get_variable(index, sub).raw
        )
        return value if isinstance(value, str) else int(value)

    def read_number(self, index: int, sub: int = 0) -> int:
        """Read a numeric object; raises as `upload` does."""
        return int(self.upload(index, sub))

    def download(self, index: int, value: int, sub: int = 0) -> None:
        """Write an object; raises as `upload` does.

        Raises:
            OutOfRangeError: the value does not fit the object's type; nothing was sent.
        """

        def write() -> None:
            self._get_variable(index, sub).data = data

        try:
            data = self._get_variable(index, sub).od.encode_raw(value)
        except (ValueError, TypeError, canopen.ObjectDictionaryError) as error:
            raise OutOfRangeError(
                f"{self._name}: {value} does not fit {_format_object(index, sub)} ({error}); nothing was sent"
            ) from error

        self._access_object(f"writing {value} to {_format_object(index, sub)}", write)

    def write_verified(self, index: int, value: int, sub: int = 0) -> None:
        """Write an object and read it back.

        Raises:
            RefusedError: the node has another value.
        """
        self.download(index, value, sub)
        stored = self.read_number(index, sub)
        if stored != value:
            raise RefusedError(
                f"{self._name}: {_format_object(index, sub)} was set to {value} but reads {stored}; "
                "the drive limits it"
            )

    def set_up_process_data(self) -> None:
        """Write the mapping of the data sheet to the node; raises as `upload` does."""

        def write() -> None:
            maps: Any = self._node.pdo
            maps.save()

        self._access_object("setting up process data", write)

    def send_process_data(self, values: dict[int, int]) -> None:
        """Send receive-PDO 1 with these values by object index, together with the SYNC that applies it.

        Objects without a value keep their last one.
        """
        self._setpoint_values.update(values)
        # In one segment: the call costs more than the bytes (decision 0011).
        self._bus.send_batch(
            (self._setpoint_mapping.identifier, self._setpoint_mapping.pack(self._setpoint_values)), _SYNC_FRAME
        )

    def send_sync(self) -> None:
        """Send a SYNC."""
        self._bus.send(*_SYNC_FRAME)

    def send_heartbeat(self, master_id: int) -> None:
        """Send the heartbeat of the master, operational."""
        self._bus.send(0x700 + master_id, b"\x05")

    def _get_variable(self, index: int, sub: int) -> Any:
        variable = self._node.sdo.get_variable(index, sub)
        if variable is None:
            raise RefusedError(
                f"{self._name}: {_format_object(index, sub)} is not in its data sheet; use the right EDS file"
            )
        return variable

    def _access_object(self, action: str, request: Callable[[], _Result]) -> _Result:
        """Execute one request at a time, with the library's errors translated."""
        with self._sdo_lock, self._bus.receive_immediately():
            self._bus.check_open()
            self._discard_late_reply()
            try:
                return request()
            except canopen.SdoAbortedError as error:
                raise RefusedError(f"{self._name}: {action}: refused: {error}") from error
            except canopen.SdoCommunicationError as error:
                self._reply_pending = True
                if str(error) != _TIMEOUT_MESSAGE:
                    raise InvalidReplyError(f"{self._name}: {action}: {error}") from error
                raise NoReplyError(
                    f"{self._name}: {action}: no reply in {self._sdo_timeout:g} s; check its cable"
                ) from error
            except (can.CanError, OSError) as error:
                raise NotConnectedError(f"{self._name}: {action}: {error}; connect again") from error
            except (struct.error, ValueError, KeyError, canopen.ObjectDictionaryError) as error:
                self._reply_pending = True
                raise InvalidReplyError(f"{self._name}: {action}: the reply cannot be decoded: {error}") from error

    def _discard_late_reply(self) -> None:
        """Wait for a reply that is still pending, and discard it."""
        if self._reply_pending:
            with contextlib.suppress(queue.Empty):
                self._node.sdo.responses.get(timeout=self._sdo_timeout)
            self._reply_pending = False

    def _on_frame(self, received_ns: int, identifier: int, data: bytes) -> None:
        """Handle a frame, on the receiving thread."""
        # Identifiers of the predefined connection set (CiA 301): heartbeat, emergency, reply to an object access.
        if identifier == 0x700 + self.node_id:
            self.heartbeat.on_heartbeat(received_ns, data)
        elif identifier == 0x80 + self.node_id:
            code, register, _ = _EMERGENCY.unpack(data)
            # A new list each time: other threads iterate over the old one.
            self.emergencies = [*self.emergencies, Emergency(code, register, received_ns)][-_MAX_EMERGENCIES:]
        elif identifier == 0x580 + self.node_id:
            self._network.notify(identifier, bytearray(data), received_ns / 1e9)


def _format_object(index: int, sub: int) -> str:
    return f"object {index:04X}h:{sub:02X}"

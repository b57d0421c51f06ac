"""One CANopen node: its state, its objects, its process data, its heartbeat and its emergencies.

`canopen` brings the object dictionary, object access and the layout of process data. It has no consumer of
heartbeats and reports silence, nonsense and refusal through one class of error; both are mended here. A late
answer is waited for once more before the next question, so that it is not taken for the answer to it.
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

from drivers.can_bus import CanBus
from drivers.canopen_layout import layout_of
from drivers.errors import BadReply, NoReply, NotConnected, OutOfRange, Refused
from drivers.instrument import Clock

# What goes wrong is raised or counted here; a library that also writes it on standard error says it twice.
logging.getLogger("canopen").addHandler(logging.NullHandler())

# The library raises one class for silence and for nonsense: these words of its own tell them apart.
_SILENCE = "No SDO response received"
_EMERGENCY = struct.Struct("<HB5s")
_STATES = {0: "boot-up", 4: "stopped", 5: "operational", 127: "pre-operational"}
_KEPT = 1000
"""Emergencies remembered."""
_SYNC = (0x80, b"")


_Answer = TypeVar("_Answer")


class Emergency(NamedTuple):
    """What the node said when something happened."""

    code: int
    """Of CiA 301 and of the device profile; 0: no fault left."""
    register: int
    received_ns: int
    """Bench clock [ns]."""


class _Network(canopen.Network):
    """The library's network on our bus."""

    def __init__(self, bus: CanBus) -> None:
        super().__init__()
        self._wire = bus

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        self._wire.send(can_id, bytes(data))


class CanopenNode:
    """A node as its master sees it.

    Args:
        name: for messages.
        bus: open, or opened later.
        node_id: on the bus.
        eds: its electronic data sheet.
        clock: of the bench [ns].
        answer_within: for one object access [s].
        silent_after: without a heartbeat, the node counts as gone [s].
    """

    def __init__(
        self,
        name: str,
        bus: CanBus,
        node_id: int,
        eds: Path,
        clock: Clock,
        *,
        answer_within: float = 0.3,
        silent_after: float = 0.25,
    ) -> None:
        self.node_id = node_id
        self.emergencies: list[Emergency] = []
        """The latest, oldest first."""
        self.boots = 0
        """Times that the node announced itself anew."""
        self._name = name
        self._bus = bus
        self._clock = clock
        self._silent_after = silent_after
        self._network = _Network(bus)
        self._node = canopen.RemoteNode(node_id, str(eds))
        self._within = self._node.sdo.RESPONSE_TIMEOUT = answer_within
        self._network.add_node(self._node)
        maps: Any = self._node.pdo
        # From the data sheet, not from the node: nobody need be on the bus yet.
        maps.read(from_od=True)
        self.layouts = tuple(layout_of(pdo) for pdo in self._node.tpdo.values())
        """The frames that the node sends, as its data sheet maps them."""
        # Packed and sent here: what SYNC brings into force, the library (2.4.1) leaves to a timer of its own.
        self._demanded = layout_of(self._node.rpdo[1])
        self._demands: dict[int, int] = {}
        self._access = threading.Lock()
        self._beat = threading.Condition()
        self._state: int | None = None
        self._beat_ns: int | None = None
        self._owed = False

    def attach(self) -> None:
        """Begin to listen on the bus."""
        self._state = self._beat_ns = None
        self._owed = False
        self._bus.unsubscribe(self._heard)  # or each new connection would hear every frame once more
        self._bus.subscribe(self._heard)

    @property
    def state(self) -> str:
        """As the last heartbeat said it."""
        if self._state is None:
            return "never heard"
        return _STATES.get(self._state, f"unknown state {self._state}")

    def check_alive(self) -> None:
        """See whether the node is still there.

        Raises:
            NotConnected: the bus has gone.
            NoReply: no heartbeat for longer than allowed.
        """
        self._bus.check()
        if self._beat_ns is None:
            raise NoReply(f"{self._name}: no heartbeat since it was connected; see its power and node id")
        age = (self._clock() - self._beat_ns) / 1e9
        if age > self._silent_after:
            raise NoReply(
                f"{self._name}: no heartbeat for {age:.3f} s, {self._silent_after:g} s are allowed; "
                f"last state {self.state}; see its power and its cable"
            )

    def command_state(self, state: int, within: float) -> None:
        """Send a network command and wait until a heartbeat confirms it.

        Args:
            state: 5 operational, 4 stopped, 127 pre-operational.
            within: deadline [s].

        Raises:
            NoReply: it was not confirmed in time.
        """
        self._bus.send(0x000, bytes([{5: 1, 4: 2, 127: 128}[state], self.node_id]))
        self._wait(lambda: self._state == state, f"state {_STATES[state]}", within)

    def wait_for_heartbeat(self, within: float) -> None:
        """Wait for a heartbeat from now on.

        Raises:
            NoReply: none came within ``within`` [s].
        """
        # Any change counts, not a state: a node in the wrong state is still there.
        before = self._beat_ns
        self._wait(lambda: self._beat_ns != before, "a heartbeat", within)

    def upload(self, index: int, sub: int = 0) -> int | str:
        """Read an object, in the wire's own unit.

        Raises:
            NoReply, BadReply, Refused, NotConnected: as the case may be.
        """
        value = self._asked(f"reading {_place(index, sub)}", lambda: self._variable(index, sub).raw)
        return value if isinstance(value, str) else int(value)

    def number(self, index: int, sub: int = 0) -> int:
        """Read a numeric object; raises as `upload` does."""
        return int(self.upload(index, sub))

    def download(self, index: int, value: int, sub: int = 0) -> None:
        """Write an object; raises as `upload` does.

        Raises:
            OutOfRange: the object's type does not hold the value; nothing was sent.
        """

        def write() -> None:
            self._variable(index, sub).data = data

        try:
            data = self._variable(index, sub).od.encode_raw(value)
        except (ValueError, TypeError, canopen.ObjectDictionaryError) as error:
            raise OutOfRange(
                f"{self._name}: {value} does not fit {_place(index, sub)} ({error}); nothing was sent"
            ) from error

        self._asked(f"writing {value} to {_place(index, sub)}", write)

    def settle(self, index: int, value: int, sub: int = 0) -> None:
        """Write an object and read it back.

        Raises:
            Refused: the node keeps another value.
        """
        self.download(index, value, sub)
        kept = self.number(index, sub)
        if kept != value:
            raise Refused(
                f"{self._name}: {_place(index, sub)} was set to {value} but reads {kept}; the drive limits it"
            )

    def set_up_process_data(self) -> None:
        """Write the mapping of the data sheet to the node; raises as `upload` does."""

        def write() -> None:
            maps: Any = self._node.pdo
            maps.save()

        self._asked("setting up process data", write)

    def lead(self, values: dict[int, int]) -> None:
        """Send receive-PDO 1 with these objects by index and the SYNC by which they count, as one.

        What is not named keeps its last value.
        """
        self._demands.update(values)
        # In one segment: a call to send costs more than what is sent (decision 0011).
        self._bus.send_together((self._demanded.identifier, self._demanded.packed(self._demands)), _SYNC)

    def send_sync(self) -> None:
        """Send a SYNC."""
        self._bus.send(*_SYNC)

    def send_heartbeat(self, master_id: int) -> None:
        """Send the heartbeat of the master, operational."""
        self._bus.send(0x700 + master_id, b"\x05")

    def _variable(self, index: int, sub: int) -> Any:
        variable = self._node.sdo.get_variable(index, sub)
        if variable is None:
            raise Refused(f"{self._name}: {_place(index, sub)} is not in its data sheet; use the right EDS file")
        return variable

    def _asked(self, what: str, ask: Callable[[], _Answer]) -> _Answer:
        """Ask the node, one question at a time, in the words of our own errors."""
        with self._access, self._bus.at_once():
            self._bus.check()
            self._await_late_answer()
            try:
                return ask()
            except canopen.SdoAbortedError as error:
                raise Refused(f"{self._name}: {what}: refused: {error}") from error
            except canopen.SdoCommunicationError as error:
                self._owed = True
                if str(error) != _SILENCE:
                    raise BadReply(f"{self._name}: {what}: {error}") from error
                raise NoReply(f"{self._name}: {what}: no answer in {self._within:g} s; see its cable") from error
            except (can.CanError, OSError) as error:
                raise NotConnected(f"{self._name}: {what}: {error}; connect again") from error
            except (struct.error, ValueError, KeyError, canopen.ObjectDictionaryError) as error:
                self._owed = True
                raise BadReply(f"{self._name}: {what}: not to be understood: {error}") from error

    def _await_late_answer(self) -> None:
        """Give an answer that is still owed its time, and throw it away."""
        if self._owed:
            with contextlib.suppress(queue.Empty):
                self._node.sdo.responses.get(timeout=self._within)
            self._owed = False

    def _heard(self, received_ns: int, identifier: int, data: bytes) -> None:
        """A frame came, on the receiving thread."""
        if identifier == 0x700 + self.node_id:
            with self._beat:
                # The highest bit is no part of the state.
                self._state, self._beat_ns = data[0] & 0x7F, received_ns
                self.boots += self._state == 0
                self._beat.notify_all()
        elif identifier == 0x80 + self.node_id:
            code, register, _ = _EMERGENCY.unpack(data)
            # A new list each time: other threads go through the old one.
            self.emergencies = [*self.emergencies, Emergency(code, register, received_ns)][-_KEPT:]
        elif identifier == 0x580 + self.node_id:
            self._network.notify(identifier, bytearray(data), received_ns / 1e9)

    def _wait(self, until: Callable[[], bool], what: str, within: float) -> None:
        with self._beat:
            if not self._beat.wait_for(until, within):
                self._bus.check()
                raise NoReply(
                    f"{self._name}: waited {within:g} s for {what}; last heard: {self.state}; "
                    "see its power, its cable and its node id"
                )


def _place(index: int, sub: int) -> str:
    return f"object {index:04X}h:{sub:02X}"

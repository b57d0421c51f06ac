"""Heartbeat consumer (CiA 301): network state and presence of one CANopen node, from its heartbeats.

The `canopen` library does not monitor heartbeats.
"""

import threading

from drivers.errors import NoReplyError
from drivers.instrument import Clock
from drivers.transport.can_bus import CanBus

STATES = {0: "boot-up", 4: "stopped", 5: "operational", 127: "pre-operational"}
"""Name of each network state by its code in a heartbeat."""


class HeartbeatConsumer:
    """Monitor of one node's heartbeats.

    Args:
        name: name of the instrument, for messages.
        bus: CAN bus of the node.
        clock: bench clock [ns].
        timeout: time without a heartbeat after which the node counts as lost [s].
    """

    def __init__(self, name: str, bus: CanBus, clock: Clock, timeout: float) -> None:
        self.boot_count = 0
        """Boot-up messages received."""
        self._name = name
        self._bus = bus
        self._clock = clock
        self._timeout = timeout
        self._received = threading.Condition()
        self._state: int | None = None
        self._received_ns: int | None = None

    def reset(self) -> None:
        """Discard what is known of the node."""
        self._state = self._received_ns = None

    def on_heartbeat(self, received_ns: int, data: bytes) -> None:
        """Take up a heartbeat, on the receiving thread."""
        with self._received:
            # The highest bit does not belong to the state.
            self._state, self._received_ns = data[0] & 0x7F, received_ns
            self.boot_count += self._state == 0
            self._received.notify_all()

    @property
    def state(self) -> str:
        """Network state in the last heartbeat."""
        if self._state is None:
            return "unknown, without a heartbeat"
        return STATES.get(self._state, f"unknown state {self._state}")

    def check_alive(self) -> None:
        """Check the age of the last heartbeat.

        Raises:
            NotConnectedError: the bus is gone.
            NoReplyError: the last heartbeat is older than the timeout.
        """
        self._bus.check_open()
        if self._received_ns is None:
            raise NoReplyError(f"{self._name}: no heartbeat since it was connected; check its power and node id")
        age = (self._clock() - self._received_ns) / 1e9
        if age > self._timeout:
            raise NoReplyError(
                f"{self._name}: no heartbeat for {age:.3f} s, {self._timeout:g} s are allowed; "
                f"last state {self.state}; check its power and its cable"
            )

    def wait_for_state(self, state: int, timeout: float) -> None:
        """Wait until a heartbeat reports a network state.

        Raises:
            NoReplyError: none did within ``timeout`` [s].
        """
        with self._received:
            is_there = self._received.wait_for(lambda: self._state == state, timeout)
        self._require(is_there, f"state {STATES[state]}", timeout)

    def wait_for_next(self, timeout: float) -> None:
        """Wait for the next heartbeat.

        Raises:
            NoReplyError: none arrived within ``timeout`` [s].
        """
        # Compare times, not states: a node in the wrong state is still there.
        previous_ns = self._received_ns
        with self._received:
            is_there = self._received.wait_for(lambda: self._received_ns != previous_ns, timeout)
        self._require(is_there, "a heartbeat", timeout)

    def _require(self, is_there: bool, event: str, timeout: float) -> None:
        if not is_there:
            self._bus.check_open()
            raise NoReplyError(
                f"{self._name}: waited {timeout:g} s for {event}; last state: {self.state}; "
                "check its power, its cable and its node id"
            )

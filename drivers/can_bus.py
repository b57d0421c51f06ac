"""One CAN bus: opened, listened to, and known to be dead when it is.

python-can does the talking: `socketcan` on real hardware, its own `socketcand` client over TCP, `virtual` inside
one process. Its notifier thread dies of any error in silence, so the receiving thread is ours and says why it
ended. Every frame is stamped on the bench clock and shown to the tap before anybody acts on it.
"""

import contextlib
import logging
import struct
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import can

from drivers.channel import Frame
from drivers.errors import DriverError, NotConnected
from drivers.instrument import Clock, Tap
from drivers.socketcand_bus import SocketcandBus

# What goes wrong is raised or counted here; the library would also write it on standard error.
logging.getLogger("can").addHandler(logging.NullHandler())

Heard = Callable[[int, int, bytes], None]
"""Told of each received frame: bench clock [ns], identifier, data."""

_FRAME = struct.Struct("<IB3x8s")
_TURN = 0.01
"""[s] the receiving thread waits for a frame before it looks whether it is still wanted."""
_ALONE = 0.05
"""[s] without anybody who takes frames, after which the receiving thread does."""
_ATTEMPTS = 3
"""A greeting may be spoilt by a frame that follows it too closely."""


@dataclass(frozen=True)
class CanAddress:
    """Where a bus is found."""

    interface: Literal["socketcan", "socketcand", "virtual"]
    channel: str = "can0"
    """Name of the bus."""
    host: str = "127.0.0.1"
    """Of a socketcand server."""
    port: int = 29536
    """Of a socketcand server."""

    def __str__(self) -> str:
        where = f" at {self.host}:{self.port}" if self.interface == "socketcand" else ""
        return f"CAN bus {self.channel} ({self.interface}{where})"


def pack_frame(identifier: int, data: bytes) -> bytes:
    """A frame as Linux writes it: identifier, length, eight bytes."""
    return _FRAME.pack(identifier, len(data), data)


def unpack_frame(packed: bytes) -> tuple[int, bytes]:
    """Identifier and data of a packed frame."""
    identifier, size, data = _FRAME.unpack(packed)
    return int(identifier), bytes(data[:size])


class CanBus:
    """An open bus and the thread that listens to it.

    Args:
        address: where it is.
        clock: of the bench [ns].
        timeout: for opening and for a send that does not get away [s].
    """

    def __init__(self, address: CanAddress, clock: Clock, timeout: float = 2.0) -> None:
        self.received = 0
        """Frames taken since it was opened."""
        self.corrupted = 0
        """Frames that were errors, or that nobody could read."""
        self._address = address
        self._clock = clock
        self._timeout = timeout
        self._bus: can.BusABC | None = None
        self._thread: threading.Thread | None = None
        self._ended: Exception | None = None
        self._heard: list[Heard] = []
        self._taps: list[Tap] = []
        self._order, self._sending = threading.Lock(), threading.Lock()
        self._receiving, self._hurry = threading.Lock(), threading.Event()
        self._taken = 0.0

    def __str__(self) -> str:
        return str(self._address)

    @property
    def is_open(self) -> bool:
        """Whether frames can pass."""
        return self._bus is not None and self._ended is None

    def open(self) -> None:
        """Open the bus and begin to listen.

        Raises:
            NotConnected: there is no such bus, nobody serves it, or the greeting fails.
        """
        self.close()
        self._bus, self._ended = self._opened(), None
        self.received = self.corrupted = 0
        self._thread = threading.Thread(target=self._listen, args=(self._bus,), name=str(self), daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening and close; harmless when repeated."""
        bus, self._bus = self._bus, None  # the listening thread ends when its bus is no longer this one
        if self._thread is not None:
            self._thread.join(self._timeout)
            self._thread = None
        if bus is not None:
            # A bus that has gone cannot be closed in good order, and whoever closes it is about to close more.
            with contextlib.suppress(can.CanError, OSError):
                bus.shutdown()

    def check(self) -> None:
        """See whether the bus is still there.

        Raises:
            NotConnected: it was never opened, or it has gone.
        """
        if self._bus is None:
            raise NotConnected(f"{self}: not open; connect first")
        if self._ended is not None:
            raise NotConnected(f"{self}: gone: {self._ended}; connect again") from self._ended

    def send(self, identifier: int, data: bytes) -> None:
        """Put a frame on the bus.

        Raises:
            NotConnected: the bus has gone.
        """
        self.send_together((identifier, data))

    def send_together(self, *frames: tuple[int, bytes]) -> None:
        """Put frames on the bus, identifier and data of each, with none of ours between them.

        Raises:
            NotConnected: the bus has gone.
        """
        self.check()
        messages = [can.Message(arbitration_id=one, data=data, is_extended_id=False) for one, data in frames]
        with self._sending:
            # Stamped before it leaves: no answer may bear an earlier stamp than its question. The order has a lock
            # of its own, for a send that does not get away must not keep those waiting who receive.
            with self._order:
                now = self._clock()
                for identifier, data in frames:
                    self._show(now, True, identifier, data)
            try:
                self._put(messages)
            except (can.CanError, OSError) as error:
                # Not raised here: whoever waits for frames of this bus has to hear of it as well.
                self._ended = error
        self.check()

    def _put(self, messages: Sequence[can.Message]) -> None:
        bus = self._bus
        if isinstance(bus, SocketcandBus):
            bus.send_together(messages)
        elif bus is not None:
            for message in messages:
                bus.send(message, self._timeout)

    def take_waiting(self) -> None:
        """Take the frames that have come, on the calling thread.

        Who does so again and again spares the bus's own thread from being woken for them.

        Raises:
            NotConnected: the bus has gone.
        """
        self.check()
        self._taken = time.monotonic()
        if self._bus is not None:
            self._receive(self._bus, 0.0)
        self.check()

    @contextlib.contextmanager
    def at_once(self) -> Iterator[None]:
        """Within, every frame is taken as it comes: somebody waits for an answer, or times it."""
        self._hurry.set()
        try:
            yield
        finally:
            self._hurry.clear()

    def subscribe(self, heard: Heard) -> None:
        """Tell ``heard`` of every frame received, on the thread that takes it."""
        self._heard.append(heard)

    def unsubscribe(self, heard: Heard) -> None:
        """Tell it no more."""
        # A new list: the receiving thread may just be going through the old one.
        self._heard = [other for other in self._heard if other != heard]

    def listen(self, tap: Tap) -> None:
        """Show ``tap`` every frame, sent and received, in the order of their stamps."""
        self._taps.append(tap)

    def _opened(self) -> can.BusABC:
        error: Exception | None = None
        for _ in range(_ATTEMPTS):
            try:
                return self._attempt()
            # A greeting that is spoilt fails at once and is worth another try; a silence has used up the time.
            except TimeoutError as timeout:
                error = timeout
                break
            except (can.CanError, OSError, ImportError, ValueError) as failed:
                error = failed
        raise NotConnected(
            f"{self}: cannot be opened within {self._timeout:g} s: {error}; "
            "see that it is up and that its name is right"
        ) from error

    def _attempt(self) -> can.BusABC:
        at = self._address
        if at.interface == "socketcand":
            return SocketcandBus(at.channel, at.host, at.port, self._timeout)
        options: dict[str, Any] = {"interface": at.interface, "channel": at.channel}
        return can.Bus(**options)

    def _listen(self, bus: can.BusABC) -> None:
        # Frames that somebody else takes are left to him: to be woken for each costs more than to take it.
        while self._bus is bus and self._ended is None:
            if self._hurry.wait(_ALONE):
                self._receive(bus, _TURN)
            elif time.monotonic() - self._taken > _ALONE:
                self._receive(bus, 0.0)

    def _receive(self, bus: can.BusABC, patience: float) -> None:
        """Take all frames that have come, waiting [s] for the first."""
        try:
            with self._receiving:
                message = bus.recv(patience)
                while message is not None:
                    self._take(message)
                    message = bus.recv(0.0)
        except Exception as error:
            # Whatever it was, nothing is heard any more: `check` tells.
            if self._bus is bus:
                self._ended = error

    def _take(self, message: can.Message) -> None:
        # CANopen speaks in data frames of eleven bits alone; others on the bus may speak as they like.
        if message.is_error_frame or message.is_remote_frame or message.is_extended_id:
            self.corrupted += message.is_error_frame
            return
        data = bytes(message.data)
        with self._order:
            now = self._clock()
            self.received += 1
            self._show(now, False, message.arbitration_id, data)
        for heard in self._heard:
            try:
                heard(now, message.arbitration_id, data)
            # A frame that one cannot make sense of must not be kept from the others.
            except (DriverError, ValueError, IndexError, struct.error):
                self.corrupted += 1

    def _show(self, now: int, sent: bool, identifier: int, data: bytes) -> None:
        frame = Frame(now, sent, pack_frame(identifier, data))
        for tap in self._taps:
            tap(frame)

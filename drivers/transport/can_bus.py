"""One CAN bus: frames sent and received with their times, and failures of the bus reported to every user.

The wire is python-can's: `socketcan` on real hardware, its own `socketcand` client over TCP, `virtual` inside one
process. Its notifier thread ends silently with any error. The receiving thread is therefore implemented here and
keeps the error. Every frame gets its bench time and is passed to the listeners before any handler.
"""

import contextlib
import logging
import struct
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import can

from drivers.channel import Frame
from drivers.errors import DriverError, NotConnectedError
from drivers.instrument import Clock, FrameListener
from drivers.transport.socketcand_bus import SocketcandBus

# Errors are raised or counted here; without a handler the library writes them to standard error as well.
logging.getLogger("can").addHandler(logging.NullHandler())

FrameHandler = Callable[[int, int, bytes], None]
"""Function that is called with each received frame: bench clock [ns], identifier, data."""

_FRAME = struct.Struct("<IB3x8s")
_RECEIVE_TIMEOUT = 0.01
"""Time that the receiving thread waits for a frame before it checks whether to stop [s]."""
_UNATTENDED_TIME = 0.05
"""Time since the last `CanBus.drain` after which the receiving thread takes the frames [s]."""
_ATTEMPTS = 3
"""Attempts to open a bus: a greeting may be spoilt by a frame that follows it too closely."""


@dataclass(frozen=True)
class CanAddress:
    """Interface and name of a CAN bus."""

    interface: Literal["socketcan", "socketcand", "virtual"]
    channel: str = "can0"
    """Name of the bus."""
    host: str = "127.0.0.1"
    """Host of the socketcand server."""
    port: int = 29536
    """Port of the socketcand server."""

    def __str__(self) -> str:
        server = f" at {self.host}:{self.port}" if self.interface == "socketcand" else ""
        return f"CAN bus {self.channel} ({self.interface}{server})"


def pack_frame(identifier: int, data: bytes) -> bytes:
    """Return a frame in the layout of Linux: identifier, length, eight bytes."""
    return _FRAME.pack(identifier, len(data), data)


def unpack_frame(packed: bytes) -> tuple[int, bytes]:
    """Return identifier and data of a packed frame."""
    identifier, size, data = _FRAME.unpack(packed)
    return int(identifier), bytes(data[:size])


class CanBus:
    """An open bus and its receiving thread.

    Args:
        address: interface and name of the bus.
        clock: bench clock [ns].
        timeout: time limit for opening and for a blocked send [s].
    """

    def __init__(self, address: CanAddress, clock: Clock, timeout: float = 2.0) -> None:
        self.received = 0
        """Frames received since the bus was opened."""
        self.corrupted = 0
        """Error frames, and frames that no handler could decode."""
        self._address = address
        self._clock = clock
        self._timeout = timeout
        self._bus: can.BusABC | None = None
        self._thread: threading.Thread | None = None
        self._failure: Exception | None = None
        self._handlers: list[FrameHandler] = []
        self._listeners: list[FrameListener] = []
        self._stamp_lock, self._send_lock = threading.Lock(), threading.Lock()
        self._receive_lock, self._immediate = threading.Lock(), threading.Event()
        self._last_drain = 0.0

    def __str__(self) -> str:
        return str(self._address)

    @property
    def is_open(self) -> bool:
        """True if frames can pass."""
        return self._bus is not None and self._failure is None

    def open(self) -> None:
        """Open the bus and begin to receive.

        Raises:
            NotConnectedError: there is no such bus, no server, or the greeting fails.
        """
        self.close()
        self._bus, self._failure = self._open_bus(), None
        self.received = self.corrupted = 0
        self._thread = threading.Thread(target=self._run_receiver, args=(self._bus,), name=str(self), daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop receiving and close the bus. May be repeated."""
        bus, self._bus = self._bus, None  # the receiving thread ends when its bus is no longer this one
        if self._thread is not None:
            self._thread.join(self._timeout)
            self._thread = None
        if bus is not None:
            # Closing a bus that is gone may fail, and must not keep the caller from closing other wires.
            with contextlib.suppress(can.CanError, OSError):
                bus.shutdown()

    def check_open(self) -> None:
        """Check that the bus is open.

        Raises:
            NotConnectedError: the bus was never opened, or is gone.
        """
        if self._bus is None:
            raise NotConnectedError(f"{self}: not open; connect first")
        if self._failure is not None:
            raise NotConnectedError(f"{self}: gone: {self._failure}; connect again") from self._failure

    def send(self, identifier: int, data: bytes) -> None:
        """Send a frame.

        Raises:
            NotConnectedError: the bus is gone.
        """
        self.send_batch((identifier, data))

    def send_batch(self, *frames: tuple[int, bytes]) -> None:
        """Send frames, each with identifier and data, without another frame of this host between them.

        Raises:
            NotConnectedError: the bus is gone.
        """
        self.check_open()
        messages = [can.Message(arbitration_id=id_, data=data, is_extended_id=False) for id_, data in frames]
        with self._send_lock:
            # The time is taken before the frame leaves: no reply may have an earlier time than its request.
            self._record_sent(frames)
            try:
                self._transmit(messages)
            except (can.CanError, OSError) as error:
                # Stored, then raised by `check_open`: threads that wait for frames of this bus must see it, too.
                self._failure = error
        self.check_open()

    def _transmit(self, messages: Sequence[can.Message]) -> None:
        bus = self._bus
        if isinstance(bus, SocketcandBus):
            bus.send_batch(messages)
        elif bus is not None:
            for message in messages:
                bus.send(message, self._timeout)

    def drain(self) -> None:
        """Handle the frames that have arrived, on the calling thread.

        While a thread calls this regularly, the bus's own thread is not woken for each frame.

        Raises:
            NotConnectedError: the bus is gone.
        """
        self.check_open()
        self._last_drain = time.monotonic()
        if self._bus is not None:
            self._receive(self._bus, 0.0)
        self.check_open()

    @contextlib.contextmanager
    def receive_immediately(self) -> Iterator[None]:
        """Handle every frame as it arrives while the context is open, for a caller that waits for a reply."""
        self._immediate.set()
        try:
            yield
        finally:
            self._immediate.clear()

    def subscribe(self, handler: FrameHandler) -> None:
        """Call ``handler`` with every frame received, on the thread that receives it."""
        self._handlers.append(handler)

    def unsubscribe(self, handler: FrameHandler) -> None:
        """Remove a handler."""
        # A new list: the receiving thread may be iterating over the old one.
        self._handlers = [other for other in self._handlers if other != handler]

    def add_listener(self, listener: FrameListener) -> None:
        """Call ``listener`` with every frame, sent and received, in the order of their times."""
        self._listeners.append(listener)

    def _open_bus(self) -> can.BusABC:
        error: Exception | None = None
        for _ in range(_ATTEMPTS):
            try:
                return self._try_open()
            # A spoilt greeting fails at once and is tried again; a silence has used up the time.
            except TimeoutError as timeout:
                error = timeout
                break
            except (can.CanError, OSError, ImportError, ValueError) as failure:
                error = failure
        raise NotConnectedError(
            f"{self}: cannot be opened within {self._timeout:g} s: {error}; "
            "check that it is up and that its name is right"
        ) from error

    def _try_open(self) -> can.BusABC:
        address = self._address
        if address.interface == "socketcand":
            return SocketcandBus(address.channel, address.host, address.port, self._timeout)
        options: dict[str, Any] = {"interface": address.interface, "channel": address.channel}
        return can.Bus(**options)

    def _run_receiver(self, bus: can.BusABC) -> None:
        # While another thread drains the bus, this one sleeps: waking for each frame costs more than handling it.
        while self._bus is bus and self._failure is None:
            if self._immediate.wait(_UNATTENDED_TIME):
                self._receive(bus, _RECEIVE_TIMEOUT)
            elif time.monotonic() - self._last_drain > _UNATTENDED_TIME:
                self._receive(bus, 0.0)

    def _receive(self, bus: can.BusABC, timeout: float) -> None:
        """Handle all frames that have arrived, waiting up to ``timeout`` [s] for the first."""
        try:
            with self._receive_lock:
                message = bus.recv(timeout)
                while message is not None:
                    self._handle_message(message)
                    message = bus.recv(0.0)
        except Exception as error:
            # Any error ends reception; `check_open` raises it.
            if self._bus is bus:
                self._failure = error

    def _handle_message(self, message: can.Message) -> None:
        # CANopen uses data frames with 11-bit identifiers only; other nodes may use the rest.
        if message.is_error_frame or message.is_remote_frame or message.is_extended_id:
            self.corrupted += message.is_error_frame
            return
        data = bytes(message.data)
        with self._stamp_lock:
            now = self._clock()
            self.received += 1
            self._notify_listeners(now, False, message.arbitration_id, data)
        for handler in self._handlers:
            try:
                handler(now, message.arbitration_id, data)
            # A frame that one handler cannot decode still goes to the others.
            except (DriverError, ValueError, IndexError, struct.error):
                self.corrupted += 1

    def _record_sent(self, frames: Iterable[tuple[int, bytes]]) -> None:
        # Under a lock of its own, since a blocked send must not stop the receiving thread.
        with self._stamp_lock:
            now = self._clock()
            for identifier, data in frames:
                self._notify_listeners(now, True, identifier, data)

    def _notify_listeners(self, now_ns: int, sent: bool, identifier: int, data: bytes) -> None:
        frame = Frame(now_ns, sent, pack_frame(identifier, data))
        for listener in self._listeners:
            listener(frame)

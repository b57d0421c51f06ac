"""One serial line: bytes out, stamped bytes in.

pyserial opens and configures the port, whatever it is: ``/dev/tty*``, a pty, ``socket://host:port``,
``rfc2217://host:port``. Where the port has a file descriptor, reading is ``select`` and ``os.read``: whatever has
come, at once, stamped with the bench clock. Elsewhere it is pyserial's own read. What the bytes mean is no
business of this file.
"""

import contextlib
import io
import os
import select
import time
import warnings

import serial

from drivers.channel import Frame
from drivers.errors import NoReply, NotConnected
from drivers.instrument import Clock, Tap

_CHUNK = 4096
"""[bytes] at most in one read."""
_PATIENCE = 0.02
"""[s] that a port without descriptor waits in one read; changing it would negotiate the line anew every time."""
_Foreign = (OSError, ValueError, TypeError, NotImplementedError)
"""What pyserial and the system raise for a port that is wrong or gone; a vanished descriptor is a TypeError."""


class SerialLine:
    """A line to one instrument.

    Reading and writing may be done by two threads; opening and closing belong to one.
    """

    def __init__(self, name: str, port: str, baud: int, clock: Clock, write_timeout: float = 0.25) -> None:
        """A closed line.

        Args:
            name: of the instrument, for messages.
            port: path or URL.
            baud: [bit/s]; a pty or plain socket ignores it.
            clock: the bench clock [ns].
            write_timeout: [s] for the line to take what is sent.
        """
        self._name = name
        self._address = port
        self._baud = baud
        self._clock = clock
        self._write_timeout = write_timeout
        self._port: serial.Serial | None = None
        self._descriptor: int | None = None
        self._taps: list[Tap] = []

    @property
    def is_open(self) -> bool:
        """Whether the line has been opened and has not gone since."""
        return self._port is not None

    def open(self) -> None:
        """Open the port, and forget what came before.

        Raises:
            NotConnected: it does not exist, is used by another process, or does not take the baud rate.
        """
        self.close()
        try:
            self._port = _port_at(self._address, self._baud, self._write_timeout)
            self._descriptor = _descriptor(self._port)
        except _Foreign as error:
            self.close()
            raise NotConnected(
                f"{self._name}: {self._address} at {self._baud} Bd cannot be opened: {error}; check the port's "
                "name, the cable and that no other program holds it"
            ) from error
        _without_adapter_delay(self._port)

    def close(self) -> None:
        """Close the port; harmless when repeated."""
        port, self._port, self._descriptor = self._port, None, None
        if port is None:
            return
        # pyserial forgets to close a socket whose other end was faster, and Python would warn of it.
        with warnings.catch_warnings(), contextlib.suppress(*_Foreign):
            warnings.simplefilter("ignore", ResourceWarning)
            port.close()

    def read(self, timeout: float) -> Frame | None:
        """Whatever has come, waiting up to ``timeout`` [s] for the first byte; none if nothing came.

        Raises:
            NotConnected: the line was never opened, or has gone.
        """
        port, descriptor = self._opened(), self._descriptor
        try:
            data = _from_port(port, timeout) if descriptor is None else _from_descriptor(descriptor, timeout)
        except _Foreign as error:
            raise self._gone(error) from error
        if data is None:
            return None
        if not data:
            raise self._gone("the other end has hung up")
        return self._told(Frame(self._clock(), False, data))

    def write(self, data: bytes) -> None:
        """Send all of it.

        Raises:
            NotConnected: the line was never opened, or has gone.
            NoReply: the line has not taken it in time.
        """
        port = self._opened()
        try:
            port.write(data)
        except serial.SerialTimeoutException as error:
            raise NoReply(
                f"{self._name}: the line took no {len(data)} bytes within {self._write_timeout:.3g} s; "
                "check flow control and cable"
            ) from error
        except _Foreign as error:
            raise self._lost(error) from error
        self._told(Frame(self._clock(), True, data))

    def listen(self, tap: Tap) -> None:
        """Tell ``tap`` of whatever is sent and received from now on."""
        self._taps.append(tap)

    def _opened(self) -> serial.Serial:
        if self._port is None:
            raise NotConnected(f"{self._name}: {self._address} is not open; connect first")
        return self._port

    def _gone(self, reason: object) -> NotConnected:
        self.close()
        return self._lost(reason)

    def _lost(self, reason: object) -> NotConnected:
        """What is said; only the reader closes, since a descriptor must not vanish under its feet."""
        return NotConnected(f"{self._name}: {self._address} has gone: {reason}; check the cable and connect again")

    def _told(self, frame: Frame) -> Frame:
        for tap in self._taps:
            tap(frame)
        return frame


def _port_at(address: str, baud: int, write_timeout: float) -> serial.Serial:
    """An open port; RFC 2217 in pyserial knows no deadline for writing."""
    deadline = None if address.startswith("rfc2217:") else write_timeout
    # Exclusive: two readers of one port would share its bytes out among them.
    return serial.serial_for_url(address, baud, timeout=_PATIENCE, write_timeout=deadline, exclusive=True)


def _descriptor(port: serial.Serial) -> int | None:
    """The port's file descriptor; none where the library keeps a thread of its own between it and us."""
    try:
        return port.fileno()
    except io.UnsupportedOperation:
        return None


def _from_descriptor(descriptor: int, timeout: float) -> bytes | None:
    """None: nothing came. Empty: the other end has gone."""
    ready, _, _ = select.select([descriptor], [], [], max(timeout, 0.0))
    return os.read(descriptor, _CHUNK) if ready else None


def _from_port(port: serial.Serial, timeout: float) -> bytes | None:
    deadline = time.monotonic() + timeout
    while True:
        data = port.read(min(max(port.in_waiting, 1), _CHUNK))
        if data or time.monotonic() >= deadline:
            return data or None


def _without_adapter_delay(port: serial.Serial) -> None:
    """Ask a USB adapter not to collect bytes for 16 ms; what is no such adapter refuses, which is as well."""
    with contextlib.suppress(AttributeError, *_Foreign):
        port.set_low_latency_mode(True)

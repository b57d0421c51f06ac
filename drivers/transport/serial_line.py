"""One serial line: bytes out, bytes with their times in.

pyserial opens and configures the port: ``/dev/tty*``, a pty, ``socket://host:port``, ``rfc2217://host:port``. If
the port has a file descriptor, reading uses ``select`` and ``os.read``, which return all that has arrived at once,
with the time of the bench clock. Otherwise it uses pyserial's own read.
"""

import contextlib
import io
import os
import select
import time
import warnings

import serial

from drivers.channel import Frame
from drivers.errors import NoReplyError, NotConnectedError
from drivers.instrument import Clock, FrameListener

_READ_SIZE = 4096
"""Largest size of one read [bytes]."""
_READ_TIMEOUT = 0.02
"""Time limit of one read of a port without descriptor [s]; changing it would negotiate the line each time."""
_PORT_ERRORS = (OSError, ValueError, TypeError, NotImplementedError)
"""Errors of pyserial and the system for a port that is wrong or gone; a vanished descriptor is a TypeError."""


class SerialLine:
    """A line to one instrument.

    Two threads may read and write; opening and closing belong to one.
    """

    def __init__(self, name: str, port: str, baud: int, clock: Clock, write_timeout: float = 0.25) -> None:
        """Prepare; nothing is opened yet.

        Args:
            name: name of the instrument, for messages.
            port: path or URL.
            baud: [bit/s]; a pty or plain socket ignores it.
            clock: bench clock [ns].
            write_timeout: time limit for the line to accept bytes [s].
        """
        self._name = name
        self._address = port
        self._baud = baud
        self._clock = clock
        self._write_timeout = write_timeout
        self._port: serial.Serial | None = None
        self._descriptor: int | None = None
        self._listeners: list[FrameListener] = []

    @property
    def is_open(self) -> bool:
        """True if the line has been opened and is not gone."""
        return self._port is not None

    def open(self) -> None:
        """Open the port, and discard earlier input.

        Raises:
            NotConnectedError: the port does not exist, is used by another process, or does not take the baud rate.
        """
        self.close()
        try:
            self._port = _open_port(self._address, self._baud, self._write_timeout)
            self._descriptor = _get_descriptor(self._port)
        except _PORT_ERRORS as error:
            self.close()
            raise NotConnectedError(
                f"{self._name}: {self._address} at {self._baud} Bd cannot be opened: {error}; check the port's "
                "name, the cable and that no other program holds it"
            ) from error
        _set_low_latency(self._port)

    def close(self) -> None:
        """Close the port. May be repeated."""
        port, self._port, self._descriptor = self._port, None, None
        if port is None:
            return
        # pyserial does not close a socket whose peer closed first, and Python would warn.
        with warnings.catch_warnings(), contextlib.suppress(*_PORT_ERRORS):
            warnings.simplefilter("ignore", ResourceWarning)
            port.close()

    def read(self, timeout: float) -> Frame | None:
        """Return all bytes that have arrived, waiting up to ``timeout`` [s] for the first; None if there are none.

        Raises:
            NotConnectedError: the line was never opened, or is gone.
        """
        port, descriptor = self._require_open(), self._descriptor
        try:
            data = _read_port(port, timeout) if descriptor is None else _read_descriptor(descriptor, timeout)
        except _PORT_ERRORS as error:
            raise self._close_lost(error) from error
        if data is None:
            return None
        if not data:
            raise self._close_lost("the other end has closed it")
        return self._notify_listeners(Frame(self._clock(), False, data))

    def write(self, data: bytes) -> None:
        """Send all bytes.

        Raises:
            NotConnectedError: the line was never opened, or is gone.
            NoReplyError: the line did not accept the bytes in time.
        """
        port = self._require_open()
        try:
            port.write(data)
        except serial.SerialTimeoutException as error:
            raise NoReplyError(
                f"{self._name}: the line did not accept {len(data)} bytes within {self._write_timeout:.3g} s; "
                "check flow control and cable"
            ) from error
        except _PORT_ERRORS as error:
            raise self._make_lost_error(error) from error
        self._notify_listeners(Frame(self._clock(), True, data))

    def add_listener(self, listener: FrameListener) -> None:
        """Call ``listener`` with all bytes sent and received from now on."""
        self._listeners.append(listener)

    def _require_open(self) -> serial.Serial:
        if self._port is None:
            raise NotConnectedError(f"{self._name}: {self._address} is not open; connect first")
        return self._port

    def _close_lost(self, reason: object) -> NotConnectedError:
        # Only the reading thread closes: the descriptor must not vanish while it reads.
        self.close()
        return self._make_lost_error(reason)

    def _make_lost_error(self, reason: object) -> NotConnectedError:
        return NotConnectedError(
            f"{self._name}: {self._address} is gone: {reason}; check the cable and connect again"
        )

    def _notify_listeners(self, frame: Frame) -> Frame:
        for listener in self._listeners:
            listener(frame)
        return frame


def _open_port(address: str, baud: int, write_timeout: float) -> serial.Serial:
    """Open a port exclusively, with a write deadline except for RFC 2217, where pyserial has none."""
    deadline = None if address.startswith("rfc2217:") else write_timeout
    # Exclusive: two readers of one port would each get some of its bytes.
    return serial.serial_for_url(address, baud, timeout=_READ_TIMEOUT, write_timeout=deadline, exclusive=True)


def _get_descriptor(port: serial.Serial) -> int | None:
    """Return the port's file descriptor; None if the library reads the port in a thread of its own."""
    try:
        return port.fileno()
    except io.UnsupportedOperation:
        return None


def _read_descriptor(descriptor: int, timeout: float) -> bytes | None:
    """Return the bytes that have arrived: none if nothing did, empty if the other end has closed."""
    ready, _, _ = select.select([descriptor], [], [], max(timeout, 0.0))
    return os.read(descriptor, _READ_SIZE) if ready else None


def _read_port(port: serial.Serial, timeout: float) -> bytes | None:
    deadline = time.monotonic() + timeout
    while True:
        data = port.read(min(max(port.in_waiting, 1), _READ_SIZE))
        if data or time.monotonic() >= deadline:
            return data or None


def _set_low_latency(port: serial.Serial) -> None:
    """Ask a USB adapter not to collect bytes for 16 ms. Other ports refuse, which is harmless."""
    with contextlib.suppress(AttributeError, *_PORT_ERRORS):
        port.set_low_latency_mode(True)

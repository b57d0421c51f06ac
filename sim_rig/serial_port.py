"""The instrument's end of a serial line: a pty or a TCP socket on loopback, as slow as its baud rate.

Neither a pty nor a socket has a baud rate, so the bytes are held back here until the line could have carried them.
They then leave in batches, as from a USB adapter, which cuts frames anywhere. What the transmit buffer cannot take
is lost as whole frames; what the host leaves unread beyond a serial port's own buffer is lost byte by byte.
"""

import contextlib
import os
import select
import socket
import threading
import tty
from collections import deque
from collections.abc import Callable
from typing import Protocol

_HOST_BUFFER = 65536
"""[bytes] that the kernel keeps for a real port. A pty keeps 8192 only, and a busy machine may leave them for
most of a second; the rest is kept here."""

Harm = Callable[[bytes], bytes]
"""What happens to one frame on its way: bytes of the frame to bytes on the line."""


def cut(frame: bytes) -> bytes:
    """The second half is lost."""
    return frame[: len(frame) // 2]


def corrupted(frame: bytes) -> bytes:
    """One bit in the middle is turned over."""
    middle = len(frame) // 2
    return frame[:middle] + bytes([frame[middle] ^ 0x04]) + frame[middle + 1 :]


def with_garbage(frame: bytes) -> bytes:
    """Noise of every byte value stands before it."""
    return bytes((37 * place + 11) % 256 for place in range(256)) + frame


def lost(frame: bytes) -> bytes:
    """Nothing of it comes through."""
    return frame[:0]


class Faults:
    """What goes wrong on the line; may be set from any thread."""

    def __init__(self) -> None:
        self.silent = False
        """While true, nothing comes through at all."""
        self._harms: deque[Harm] = deque()

    def inject(self, harm: Harm, frames: int = 1) -> None:
        """Let the next ``frames`` frames suffer ``harm``, behind what was injected before."""
        self._harms.extend([harm] * frames)

    @property
    def pending(self) -> int:
        """Frames that are still to suffer."""
        return len(self._harms)

    def suffered(self, frame: bytes) -> bytes:
        """The frame as it comes through."""
        if self.silent:
            return b""
        return self._harms.popleft()(frame) if self._harms else frame


class SerialPort:
    """One line, its host at most one; used by one thread, but for `hang_up`."""

    def __init__(self, address: str, baud: int, buffer: int, batch: float) -> None:
        """Open it.

        Args:
            address: ``pty``, or ``host:port`` with port 0 for any free one.
            baud: [bit/s], ten bits a byte.
            buffer: [bytes] that wait for the line at most.
            batch: [s] between two batches, 0 for none.
        """
        self.faults = Faults()
        self.overruns = 0
        """Frames that found the transmit buffer full."""
        self.unread = 0
        """Bytes that the host has left unread for too long."""
        self._end = _Pty() if address == "pty" else _Listener(address)
        self._byte_ns = round(10e9 / baud)
        self._buffer = buffer
        self._batch_ns = round(batch * 1e9)
        self._waiting = bytearray()
        self._carried = bytearray()
        self._begun_ns = 0
        self._batched_ns = 0

    @property
    def address(self) -> str:
        """What a host opens: the pty's path, or ``socket://host:port``."""
        return self._end.address

    def send(self, frame: bytes, now_ns: int) -> None:
        """Put a frame into the transmit buffer at ``now_ns`` of the rig's clock [ns].

        Frames come in the order of their times, but may be handed over late: until then the line has gone on
        carrying what stood before them, so that a late thread of the rig is no overrun of the instrument.
        """
        self._carry(now_ns)
        through = self.faults.suffered(frame)
        if len(self._waiting) + len(through) > self._buffer:
            self.overruns += 1
            return
        if not self._waiting:  # an idle line begins with the frame, a busy one goes on
            self._begun_ns = now_ns
        self._waiting += through

    def until_batch(self, now_ns: int) -> float:
        """[s] until the next batch may go, 0 if it may."""
        return max(self._batched_ns + self._batch_ns - now_ns, 0) * 1e-9

    def flush(self, now_ns: int) -> None:
        """Hand over what the line could have carried until ``now_ns`` [ns], if a batch is due."""
        self._carry(now_ns)
        if not self._carried or now_ns - self._batched_ns < self._batch_ns:
            return
        del self._carried[: self._end.write(bytes(self._carried))]  # what the host leaves unread stays here
        self._batched_ns = now_ns

    def _carry(self, now_ns: int) -> None:
        """Let the line carry bytes until ``now_ns`` [ns]."""
        count = min(max(now_ns - self._begun_ns, 0) // self._byte_ns, len(self._waiting))
        room = _HOST_BUFFER - len(self._carried)
        self._carried += self._waiting[: min(count, room)]
        self.unread += max(count - room, 0)
        del self._waiting[:count]
        self._begun_ns += count * self._byte_ns

    def receive(self, timeout: float) -> bytes:
        """What the host has sent, waiting up to ``timeout`` [s] for it; empty if nothing."""
        return self._end.read(timeout)

    def hang_up(self) -> None:
        """Pull the cable: a TCP host is cut off and may connect again; a pty is gone for good."""
        self._end.hang_up()

    def close(self) -> None:
        """Close the line."""
        self._end.close()


class _Pty:
    """A pseudo terminal; its own hold on the slave side keeps it open while no host is there."""

    def __init__(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.address = os.ttyname(self._slave)

    def write(self, data: bytes) -> int:
        """How many bytes it took."""
        try:
            return os.write(self._master, data)
        except BlockingIOError:
            return 0
        except OSError:
            return len(data)

    def read(self, timeout: float) -> bytes:
        watched = [self._master] if self._master >= 0 else []
        with contextlib.suppress(OSError):
            if select.select(watched, [], [], timeout)[0]:
                return os.read(self._master, 4096)
        return b""

    def hang_up(self) -> None:
        self.close()

    def close(self) -> None:
        master, self._master = self._master, -1
        if master >= 0:
            os.close(master)
            os.close(self._slave)


class _Listener:
    """A TCP socket that serves one host at a time; a new one takes over, as after a broken connection."""

    def __init__(self, address: str) -> None:
        host, _, port = address.rpartition(":")
        self._server = socket.create_server((host, int(port)))
        self._host: socket.socket | None = None
        self.address = "socket://{}:{}".format(*self._server.getsockname()[:2])

    def write(self, data: bytes) -> int:
        """How many bytes it took; all of them where nobody listens."""
        try:
            return len(data) if self._host is None else self._host.send(data)
        except BlockingIOError:
            return 0
        except OSError:
            return len(data)

    def read(self, timeout: float) -> bytes:
        watched = [self._server] if self._host is None else [self._server, self._host]
        try:
            ready = select.select(watched, [], [], timeout)[0]
            if self._server in ready:
                self._accept()
            elif ready and self._host is not None:
                return self._heard(self._host)
        except (OSError, ValueError):
            self.hang_up()
        return b""

    def _accept(self) -> None:
        self.hang_up()
        self._host = self._server.accept()[0]
        self._host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._host.setblocking(False)

    def _heard(self, host: socket.socket) -> bytes:
        data = host.recv(4096)
        if not data:
            self.hang_up()
        return data

    def hang_up(self) -> None:
        host, self._host = self._host, None
        if host is not None:
            host.close()

    def close(self) -> None:
        self.hang_up()
        self._server.close()


class Device(Protocol):
    """The meaning of the bytes; knows no socket."""

    def hear(self, data: bytes, now_ns: int) -> list[bytes]:
        """Frames that answer what the host has sent."""

    def speak(self, now_ns: int) -> list[tuple[int, bytes]]:
        """Frames that are due by themselves until ``now_ns`` [ns], each with its own time [ns]."""


class SerialAdapter:
    """A device on its port, in a thread of its own; a context manager."""

    def __init__(self, port: SerialPort, device: Device, now: Callable[[], int], poll: float = 0.002) -> None:
        """Not serving yet.

        Args:
            port: the line.
            device: what lives on it.
            now: the rig's clock [ns].
            poll: [s] of real time between two looks at it.
        """
        self.port = port
        self.faults = port.faults
        self.address = port.address
        self._device = device
        self._now = now
        self._poll = poll
        self._stopping = threading.Event()
        self._hanging_up = threading.Event()
        self._thread = threading.Thread(target=self._serve, name=f"serial {self.address}", daemon=True)

    def start(self) -> str:
        """Serve from now on; the address that a host opens."""
        self._thread.start()
        return self.address

    def stop(self) -> None:
        """Stop serving and close the line; harmless when repeated."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join()
        self.port.close()

    def hang_up(self) -> None:
        """Pull the cable, as `SerialPort.hang_up`."""
        self._hanging_up.set()

    def __enter__(self) -> "SerialAdapter":
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _serve(self) -> None:
        while not self._stopping.is_set():
            heard = self.port.receive(min(self._poll, self.port.until_batch(self._now()) or self._poll))
            if self._hanging_up.is_set():
                self._hanging_up.clear()
                self.port.hang_up()
            now = self._now()
            for at_ns, frame in self._device.speak(now):
                self.port.send(frame, at_ns)
            for answer in self._device.hear(heard, now):
                self.port.send(answer, now)
            self.port.flush(now)

"""The instrument's end of a serial line: a pty or a TCP socket on loopback, as slow as its baud rate.

Neither a pty nor a socket has a baud rate, so the bytes are held back here until the line could have carried them.
They then leave in batches, as from a USB adapter, which cuts frames anywhere. What the transmit buffer cannot take
is lost as whole frames; what the host leaves unread beyond a serial port's own buffer is lost byte by byte.
"""

from collections import deque
from collections.abc import Callable

from sim_rig.serial_ends import Listener, Pty

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
        self._end = Pty() if address == "pty" else Listener(address)
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

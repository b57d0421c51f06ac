"""Serial line on the instrument's side: a pty or a TCP socket on loopback, with the timing of its baud rate.

Neither a pty nor a socket has a baud rate, so bytes are delayed here by their transmission time. They then leave
in batches, as from a USB adapter, which may divide frames anywhere. Frames that exceed the transmit buffer are
lost as a whole. Bytes that the host does not read are lost one by one beyond the buffer of a real serial port.
"""

from collections import deque
from collections.abc import Callable

from sim_rig.protocols.serial_endpoint import Pty, TcpEndpoint

_HOST_BUFFER = 65536
"""[bytes] that the kernel buffers for a real port.

A pty buffers only 8192, and a busy computer may leave them unread for most of a second; the rest is kept here.
"""

FrameFault = Callable[[bytes], bytes]
"""Fault of one frame: bytes of the frame to bytes on the line."""


def truncate(frame: bytes) -> bytes:
    """Return the first half of the frame."""
    return frame[: len(frame) // 2]


def flip_bit(frame: bytes) -> bytes:
    """Return the frame with one flipped bit in its middle."""
    middle = len(frame) // 2
    return frame[:middle] + bytes([frame[middle] ^ 0x04]) + frame[middle + 1 :]


def prepend_noise(frame: bytes) -> bytes:
    """Return the frame after noise of every byte value."""
    return make_noise(256) + frame


def drop(frame: bytes) -> bytes:
    """Return no bytes."""
    return frame[:0]


def make_noise(count: int) -> bytes:
    """Return up to 256 reproducible bytes, all different."""
    return bytes((37 * i + 11) % 256 for i in range(count))


class LineFaults:
    """Faults of the line; may be injected from any thread."""

    def __init__(self) -> None:
        self.silent = False
        """While true, no frame passes."""
        self._queue: deque[FrameFault] = deque()

    def inject(self, fault: FrameFault, frames: int = 1) -> None:
        """Apply a fault to the next frames, after the faults injected before."""
        self._queue.extend([fault] * frames)

    @property
    def pending_count(self) -> int:
        """Number of frames that still get a fault."""
        return len(self._queue)

    def apply(self, frame: bytes) -> bytes:
        """Return the bytes of the frame that pass."""
        if self.silent:
            return b""
        return self._queue.popleft()(frame) if self._queue else frame


class SerialPort:
    """One line with at most one host; used by one thread, except for `hang_up`."""

    def __init__(self, address: str, baud: int, buffer: int, batch: float) -> None:
        """Open the line.

        Args:
            address: ``pty``, or ``host:port`` with port 0 for any free one.
            baud: [bit/s], ten bits per byte.
            buffer: [bytes] size of the transmit buffer.
            batch: [s] between two batches, 0 for no batches.
        """
        self.faults = LineFaults()
        self.overruns = 0
        """Number of frames lost because the transmit buffer was full."""
        self.unread_bytes = 0
        """Number of bytes lost because the host did not read them."""
        self._end = Pty() if address == "pty" else TcpEndpoint(address)
        self._byte_ns = round(10e9 / baud)
        self._buffer = buffer
        self._batch_ns = round(batch * 1e9)
        self._transmit_buffer = bytearray()
        self._host_buffer = bytearray()
        self._transmit_ns = 0
        self._last_batch_ns = 0

    @property
    def address(self) -> str:
        """Address for a host: the pty's path, or ``socket://host:port``."""
        return self._end.address

    def send(self, frame: bytes, now_ns: int) -> None:
        """Put a frame into the transmit buffer at ``now_ns`` of the rig's clock [ns].

        Frames come in the order of their times, but may be handed over late. The line transmits earlier frames
        until then, so a late thread of the rig does not cause an overrun of the instrument.
        """
        self._transmit(now_ns)
        passed = self.faults.apply(frame)
        if len(self._transmit_buffer) + len(passed) > self._buffer:
            self.overruns += 1
            return
        if not self._transmit_buffer:  # an idle line starts with this frame
            self._transmit_ns = now_ns
        self._transmit_buffer += passed

    def compute_batch_wait(self, now_ns: int) -> float:
        """Return the time [s] until the next batch may be sent, 0 if it may now."""
        return max(self._last_batch_ns + self._batch_ns - now_ns, 0) * 1e-9

    def flush(self, now_ns: int) -> None:
        """Send the bytes transmitted until ``now_ns`` [ns] to the host, if a batch is due."""
        self._transmit(now_ns)
        if not self._host_buffer or now_ns - self._last_batch_ns < self._batch_ns:
            return
        accepted = self._end.write(bytes(self._host_buffer))
        del self._host_buffer[:accepted]
        self._last_batch_ns = now_ns

    def _transmit(self, now_ns: int) -> None:
        """Transmit bytes on the line until ``now_ns`` [ns]."""
        count = min(max(now_ns - self._transmit_ns, 0) // self._byte_ns, len(self._transmit_buffer))
        room = _HOST_BUFFER - len(self._host_buffer)
        self._host_buffer += self._transmit_buffer[: min(count, room)]
        self.unread_bytes += max(count - room, 0)
        del self._transmit_buffer[:count]
        self._transmit_ns += count * self._byte_ns

    def receive(self, timeout: float) -> bytes:
        """Return data from the host, waiting up to ``timeout`` [s] for it; empty if none arrived."""
        return self._end.read(timeout)

    def hang_up(self) -> None:
        """Disconnect the host: over TCP it may connect again, a pty is closed permanently."""
        self._end.hang_up()

    def close(self) -> None:
        """Close the line."""
        self._end.close()

"""Thread that serves a device on its serial port."""

import threading
from collections.abc import Callable
from typing import Protocol

from sim_rig.protocols.serial_port import SerialPort


class SerialDevice(Protocol):
    """Behaviour of an instrument on a serial line, without the line."""

    def receive(self, data: bytes, now_ns: int) -> list[bytes]:
        """Return the replies to data from the host."""

    def poll(self, now_ns: int) -> list[tuple[int, bytes]]:
        """Return the unsolicited frames due until ``now_ns`` [ns], each with its own time [ns]."""


class SerialAdapter:
    """A device on its port, with its own thread; a context manager."""

    def __init__(
        self, port: SerialPort, device: SerialDevice, now: Callable[[], int], poll: float = 0.002
    ) -> None:
        """Connect device and port; `start` begins to serve.

        Args:
            port: the line.
            device: the instrument on it.
            now: returns the rig's clock [ns].
            poll: [s] of real time between two polls of the device.
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
        """Start to serve; return the address for a host."""
        self._thread.start()
        return self.address

    def stop(self) -> None:
        """Stop serving and close the line; harmless when repeated."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join()
        self.port.close()

    def hang_up(self) -> None:
        """Disconnect the host, as `SerialPort.hang_up`."""
        self._hanging_up.set()

    def __enter__(self) -> "SerialAdapter":
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _serve(self) -> None:
        while not self._stopping.is_set():
            data = self.port.receive(min(self._poll, self.port.compute_batch_wait(self._now()) or self._poll))
            if self._hanging_up.is_set():
                self._hanging_up.clear()
                self.port.hang_up()
            now = self._now()
            for at_ns, frame in self._device.poll(now):
                self.port.send(frame, at_ns)
            for reply in self._device.receive(data, now):
                self.port.send(reply, now)
            self.port.flush(now)

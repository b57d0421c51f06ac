"""A device on its serial port, in a thread of its own."""

import threading
from collections.abc import Callable
from typing import Protocol

from sim_rig.serial_port import SerialPort


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

"""A small rig for the Modbus tests: known signals on a clock that the test moves, and servers on every wire."""

import contextlib
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np

from drivers.modbus_address import ModbusAddress
from sim_rig.modbus_frames import MBAP, RTU
from sim_rig.modbus_requests import Device
from sim_rig.modbus_server import ModbusServer

MS = 1_000_000
TIMEOUT = 0.1
WIRES = ("tcp", "rtu over socket", "rtu over pty")
UNITS = {"displacement": 1e-7, "coil_voltage": 1e-4, "coil_current": 1e-4, "temperature": 1e-2}
"""Least step of each channel on the wire."""


def truth(channel: str, times: np.ndarray) -> np.ndarray:
    """What a channel is at instants [ns]."""
    seconds = times * 1e-9
    return {
        "displacement": 0.02 * np.sin(2 * np.pi * seconds),
        "coil_voltage": 2.0 + np.sin(2 * np.pi * 3 * seconds),
        "coil_current": 0.4 + 0.2 * np.sin(2 * np.pi * 3 * seconds),
        "temperature": 22.0 + seconds,
    }[channel]


class FakeSignals:
    """The rig as the adapters see it; time moves only when the test says so."""

    def __init__(self, now_ns: int = 5_000 * MS) -> None:
        self._now = now_ns
        self._lock = threading.Lock()
        self.commands: list[tuple[int, str, float]] = []
        self.dead: set[str] = set()

    def now_ns(self) -> int:
        return self._now

    def step(self, milliseconds: float) -> None:
        with self._lock:
            self._now += round(milliseconds * MS)

    def latest(self, channel: str, count: int, before_ns: int) -> tuple[np.ndarray, np.ndarray]:
        interval = 100 * MS if channel == "temperature" else MS
        newest = before_ns // interval
        times = np.arange(max(0, newest - count + 1), newest + 1, dtype=np.int64) * interval
        values = truth(channel, times)
        return times, np.full_like(values, np.nan) if channel in self.dead else values

    def command(self, channel: str, value: float, at_ns: int | None = None) -> None:
        self.commands.append((self._now, channel, value))

    @property
    def drive(self) -> float:
        """Where the drive has been sent last."""
        return self.commands[-1][2] if self.commands else 0.0


@contextlib.contextmanager
def served(device: Device, wire: str, unit: int = 1) -> Iterator[tuple[ModbusServer, ModbusAddress]]:
    """A device on one of the WIRES, and where it is reached."""
    server = ModbusServer(device, unit, MBAP if wire == "tcp" else RTU)
    (server.listen_pty if wire == "rtu over pty" else server.listen)()
    with server:
        yield server, ModbusAddress(server.address, baud=None if wire == "tcp" else 115200)


def until(true: Callable[[], bool], seconds: float = 5.0) -> None:
    """Wait for something that happens in another thread."""
    deadline = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.002)

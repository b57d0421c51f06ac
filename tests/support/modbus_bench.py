"""Small rig for the Modbus tests: known signals on a clock that the test steps, and servers on all wires."""

import contextlib
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np

from drivers.transport.modbus_address import ModbusAddress
from sim_rig.protocols.modbus_frames import MBAP, RTU
from sim_rig.protocols.modbus_requests import ModbusDevice
from sim_rig.protocols.modbus_server import ModbusServer

MS = 1_000_000
TIMEOUT = 0.1
WIRES = ("tcp", "rtu over socket", "rtu over pty")
RESOLUTION = {"displacement": 1e-7, "coil_voltage": 1e-4, "coil_current": 1e-4, "temperature": 1e-2}
"""Step of each channel on the wire."""


def truth(channel: str, times: np.ndarray) -> np.ndarray:
    """Return the true values of a channel at instants [ns]."""
    seconds = times * 1e-9
    return {
        "displacement": 0.02 * np.sin(2 * np.pi * seconds),
        "coil_voltage": 2.0 + np.sin(2 * np.pi * 3 * seconds),
        "coil_current": 0.4 + 0.2 * np.sin(2 * np.pi * 3 * seconds),
        "temperature": 22.0 + seconds,
    }[channel]


class FakeSignals:
    """Rig interface of the simulated instruments; only the test moves its time."""

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

    def read_latest(self, channel: str, count: int, before_ns: int) -> tuple[np.ndarray, np.ndarray]:
        interval = 100 * MS if channel == "temperature" else MS
        newest = before_ns // interval
        times = np.arange(max(0, newest - count + 1), newest + 1, dtype=np.int64) * interval
        values = truth(channel, times)
        return times, np.full_like(values, np.nan) if channel in self.dead else values

    def command(self, channel: str, value: float, at_ns: int | None = None) -> None:
        self.commands.append((self._now, channel, value))

    @property
    def drive(self) -> float:
        """Last commanded drive."""
        return self.commands[-1][2] if self.commands else 0.0


@contextlib.contextmanager
def serve(device: ModbusDevice, wire: str, unit: int = 1) -> Iterator[tuple[ModbusServer, ModbusAddress]]:
    """Serve a device on one of the WIRES; yield the server and its address."""
    server = ModbusServer(device, unit, MBAP if wire == "tcp" else RTU)
    (server.listen_pty if wire == "rtu over pty" else server.listen)()
    with server:
        yield server, ModbusAddress(server.address, baud=None if wire == "tcp" else 115200)


def wait_until(condition: Callable[[], bool], timeout: float = 5.0) -> None:
    """Wait for a condition that another thread fulfils."""
    deadline = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < deadline, "the condition did not become true in time"
        time.sleep(0.002)

"""A simulated drive on a socketcand server with a simple rod, for the tests of the actuator."""

import bisect
import contextlib
import math
import threading
import time
from collections.abc import Callable

import numpy as np

from drivers.actuator.actuator import Actuator
from drivers.actuator.servo_drive import ActuatorSettings
from drivers.transport.can_bus import CanAddress
from sim_rig.instruments.servo_drive import ServoDriveDevice
from sim_rig.live.clock import RunningClock
from sim_rig.protocols.socketcand_server import SocketcandServer

STEP_NS = 1_000_000


def wait_until(condition: Callable[[], object], deadline: float = 5.0) -> None:
    """Poll until a condition holds."""
    end = time.monotonic() + deadline
    while not condition():
        assert time.monotonic() < end, "waited too long"
        time.sleep(0.001)


class IdealRod:
    """Signals of a rod that is always at its commanded position, sampled every millisecond."""

    def __init__(self) -> None:
        self.force = 120.0
        self.stuck = False
        self.clock = RunningClock()
        self._lock = threading.Lock()
        self._times, self._targets = [-10 * STEP_NS], [0.0]

    def now_ns(self) -> int:
        return self.clock.now_ns()

    def command(self, channel: str, value: float, at_ns: int | None = None) -> None:
        assert channel == "displacement"
        self._add(self.now_ns(), value)

    def schedule_position(self, position: float, at_ns: int, since_ns: int) -> None:
        self._add(at_ns, position)

    def _add(self, at_ns: int, position: float) -> None:
        with self._lock:
            while len(self._times) > 1 and self._times[-1] >= at_ns:
                self._times.pop(), self._targets.pop()
            if not self.stuck:
                self._times.append(at_ns)
                self._targets.append(position)

    def read_latest(self, channel: str, count: int, before_ns: int):
        last = before_ns // STEP_NS
        times = np.arange(last - count + 1, last + 1, dtype=np.int64) * STEP_NS
        if channel == "force":
            return times, np.full(count, self.force)
        assert channel == "actuator_position"
        with self._lock:
            indices = [max(bisect.bisect_right(self._times, t) - 1, 0) for t in times]
            return times, np.array([self._targets[index] for index in indices])

    @property
    def position(self) -> float:
        return self._targets[-1]


class CanRig:
    """Rod, simulated drive and server."""

    def __init__(self, **drive) -> None:
        self.rod = IdealRod()
        self.drive = ServoDriveDevice(self.rod, **drive)
        self.server = SocketcandServer([self.drive], self.rod.clock).start()

    @property
    def injection(self):
        return self.drive.slave.injection

    def close(self) -> None:
        self.server.close()


# Tests share busy cores with others: these timeouts are longer than on a bench.
PATIENT = ActuatorSettings(
    setpoint_timeout=0.5, master_heartbeat_timeout=1.0, drive_heartbeat_timeout=1.0, max_speed=5.0
)


def sine(t: float) -> float:
    """Return a sine of 10 mm at 2 Hz [m]."""
    return 0.01 * math.sin(2 * math.pi * 2 * t)


@contextlib.contextmanager
def connected(rig: CanRig, settings: ActuatorSettings = PATIENT, **options):
    """Connect an actuator, and close it at the end."""
    address = CanAddress("socketcand", port=rig.server.port)
    actuator = Actuator("actuator", address, time.monotonic_ns, settings=settings, **options)
    actuator.connect()
    try:
        yield actuator
    finally:
        actuator.close()


def collect_positions(actuator: Actuator, count: int) -> list:
    """Acquire position blocks until there are ``count`` samples."""
    blocks = []

    def is_enough() -> bool:
        blocks.extend(b for b in actuator.acquire(0.05) if b.channel == "actuator_position")
        return sum(len(b.values) for b in blocks) >= count

    wait_until(is_enough)
    return blocks


class SetpointThread:
    """Sends a setpoint every cycle until stopped, as the agent does."""

    def __init__(self, actuator, path: Callable[[float], float]) -> None:
        self.error: Exception | None = None
        self.sent: list[float] = []
        self._actuator, self._path = actuator, path
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._send_setpoints, daemon=True)

    def __enter__(self) -> "SetpointThread":
        self._actuator.arm()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        self._stop.set()
        self._thread.join(5)

    def _send_setpoints(self) -> None:
        cycle, start = self._actuator.settings.cycle, time.monotonic()
        for k in range(100_000):
            if self._stop.wait(max(start + k * cycle - time.monotonic(), 0)):
                return
            try:
                self._actuator.send_setpoint(self._path(k * cycle))
            except Exception as error:
                self.error = error
                return
            self.sent.append(self._path(k * cycle))

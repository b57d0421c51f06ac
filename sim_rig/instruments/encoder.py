"""Sensors of the simulated servo drive: encoder, motor torque, clock."""

import math
from operator import mul
from typing import NamedTuple

from sim_rig.live import DeviceClock, RigInterface


class DriveMechanics(NamedTuple):
    """Mechanics and clock of the drive."""

    screw_lead: float = 5e-3
    """[m] travel of the rod for one turn of the motor."""
    torque: float = 1.27
    """[N m] rated torque of the motor."""
    limit_switch: float = -0.06
    """[m] rig position at which the negative limit switch closes."""
    ppm: float = 12.0
    """[ppm] rate error of the drive's clock, positive for a fast clock."""
    clock_offset_ns: int = 1_234_567_891
    """[ns] reading of the drive's clock at zero of the rig's."""


DEFAULT_MECHANICS = DriveMechanics()


def compute_torque(force: float, lead: float = DEFAULT_MECHANICS.screw_lead) -> float:
    """Return the motor torque [N m] for a force [N] through a lossless screw of this lead [m]."""
    return force * lead / (2 * math.pi)


class DriveSensors:
    """Measurements of one drive on a rig."""

    def __init__(self, signals: RigInterface, mechanics: DriveMechanics) -> None:
        self._signals, self._mechanics = signals, mechanics
        self._clock = DeviceClock(mechanics.clock_offset_ns, mechanics.ppm)

    def read_clock_us(self, rig_ns: int) -> int:
        """Return its clock [us] at an instant of the rig's clock [ns], wrapped to 32 bits."""
        return self._clock.read_ns(rig_ns) // 1000 % 2**32

    def read_position(self) -> tuple[int, float]:
        """Return time [ns] and position [m] of the newest sample."""
        now_ns = self._signals.now_ns()
        times, values = self._signals.read_latest("actuator_position", 1, now_ns)
        return (int(times[-1]), float(values[-1])) if len(values) else (now_ns, 0.0)

    def read_motion(self, now_ns: int) -> tuple[int, float, float]:
        """Return time [ns], position [m] and velocity [m/s] from the last five samples."""
        times, values = self._signals.read_latest("actuator_position", 5, now_ns)
        # For five samples, lists take less time than arrays.
        instants, positions = times.tolist(), values.tolist()
        if len(positions) < 2 or not all(map(math.isfinite, positions)):
            return now_ns, (positions[-1] if positions else 0.0), 0.0
        # Least squares over all five: between two samples, 1 ms apart, the encoder step of 5 µm would be 5 mm/s.
        seconds = [(instant - instants[-1]) / 1e9 for instant in instants]
        mean = sum(seconds) / len(seconds)
        spread = [second - mean for second in seconds]
        slope = sum(map(mul, spread, positions)) / sum(map(mul, spread, spread))
        return instants[-1], positions[-1], slope

    def read_torque(self, now_ns: int, rated: float) -> int:
        """Return the motor torque for the force on the rod, in thousandths of ``rated`` [N m]."""
        _, force = self._signals.read_latest("force", 1, now_ns)
        newtons = float(force[-1]) if len(force) and math.isfinite(force[-1]) else 0.0
        per_mille = round(compute_torque(newtons, self._mechanics.screw_lead) / rated * 1000)
        return max(min(per_mille, 32767), -32768)

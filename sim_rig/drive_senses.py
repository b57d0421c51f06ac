"""What a servo drive knows of its rod by itself: encoder, current of the motor, its own clock."""

import math
from typing import NamedTuple

import numpy as np

from sim_rig.device_clock import DeviceClock
from sim_rig.signals import Signals


class Machine(NamedTuple):
    """What this drive is coupled to."""

    lead: float = 5e-3
    """[m] the rod moves for one turn of the motor."""
    torque: float = 1.27
    """[N m] rated, of the motor."""
    switch: float = -0.06
    """[m] rig position at which the negative limit switch closes."""
    ppm: float = 12.0
    """[ppm] by which the drive's clock is fast."""
    clock_offset_ns: int = 1_234_567_891
    """[ns] shown by the drive's clock when the rig's shows zero."""


PLAIN_MACHINE = Machine()


def torque_for(force: float, lead: float = PLAIN_MACHINE.lead) -> float:
    """Torque [N m] of the motor that pushes with a force [N] through a screw of this lead [m], without loss."""
    return force * lead / (2 * math.pi)


class DriveSenses:
    """The senses of one drive on a rig."""

    def __init__(self, signals: Signals, machine: Machine) -> None:
        self._signals, self._machine = signals, machine
        self._clock = DeviceClock(machine.clock_offset_ns, machine.ppm)

    def micros(self, rig_ns: int) -> int:
        """What its clock shows at an instant of the rig's [us], wrapped."""
        return self._clock.ns(rig_ns) // 1000 % 2**32

    def position(self) -> tuple[int, float]:
        """Time [ns] and place [m] of the newest sample."""
        now_ns = self._signals.now_ns()
        times, values = self._signals.latest("actuator_position", 1, now_ns)
        return (int(times[-1]), float(values[-1])) if len(values) else (now_ns, 0.0)

    def measured(self, now_ns: int) -> tuple[int, float, float]:
        """Time [ns], position [m] and velocity [m/s] over the last samples."""
        times, values = self._signals.latest("actuator_position", 5, now_ns)
        if len(values) < 2 or not np.isfinite(values).all():
            return now_ns, (float(values[-1]) if len(values) else 0.0), 0.0
        # Least squares over all of them: between two samples a millisecond apart, a step of 5 µm is 5 mm/s.
        seconds = (times - times[-1]) / 1e9
        spread = seconds - seconds.mean()
        return int(times[-1]), float(values[-1]), float(spread @ values / (spread @ spread))

    def torque(self, now_ns: int, rated: float) -> int:
        """Motor torque behind the force on the rod [per mille of ``rated`` [N m]]."""
        _, force = self._signals.latest("force", 1, now_ns)
        newtons = float(force[-1]) if len(force) and math.isfinite(force[-1]) else 0.0
        share = round(torque_for(newtons, self._machine.lead) / rated * 1000)
        return max(min(share, 32767), -32768)

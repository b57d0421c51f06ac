"""Trajectories: sampled motions on their own time, scheduled to begin at an instant of the bench clock.

All functions are pure functions of time, so the setpoint thread (one instant) and the recorder (many instants)
obtain the same values. A soft stop slows the trajectory's own time down to zero. The rod therefore stays on its
path and never moves faster than planned.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bench.methods import compute_move, compute_move_duration

Array = npt.NDArray[np.float64]
Times = npt.NDArray[np.int64]

MOVE_VELOCITY, MOVE_ACCELERATION = 0.03, 0.3
"""[m/s], [m/s²] Peak velocity and acceleration of the move to the start of a method."""
STOP_TIMES = (0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)
"""[s] Possible durations of a soft stop; the shortest that respects the acceleration limit is used."""
_MOVE_RATE = 1000.0
"""[Hz] Sampling rate of moves that are not part of a method; setpoints are interpolated."""
_STOP_SAMPLES = 200
"""Number of instants at which the acceleration of a soft stop is evaluated."""


@dataclass(frozen=True)
class Trajectory:
    """Uniformly sampled motion, each array of shape (samples,); at rest before its begin and after its end."""

    rate: float
    """[Hz]"""
    displacement: Array
    """[m]"""
    velocity: Array
    """[m/s]"""
    acceleration: Array
    """[m/s²]"""

    @property
    def duration(self) -> float:
        """[s] Time from the first to the last sample."""
        return (len(self.displacement) - 1) / self.rate

    def interpolate(self, values: Array, time: Array) -> Array:
        """Interpolate a column linearly at times from the begin [s]; constant outside the trajectory."""
        position = np.clip(time, 0.0, self.duration) * self.rate
        before = np.minimum(position.astype(np.int64), max(len(values) - 2, 0))
        after = np.minimum(before + 1, len(values) - 1)
        return np.asarray(values[before] + (position - before) * (values[after] - values[before]))


def make_standstill(position: float) -> Trajectory:
    """Return a trajectory that rests at a position [m]."""
    zero = np.zeros(1)
    return Trajectory(_MOVE_RATE, np.array([position]), zero, zero)


def plan_approach(start: float, end: float) -> Trajectory:
    """Plan a slow move from rest at ``start`` to rest at ``end`` [m]."""
    if start == end:
        return make_standstill(end)
    duration = compute_move_duration(end - start, MOVE_VELOCITY, MOVE_ACCELERATION)
    motion = compute_move(start, end, duration, np.arange(round(duration * _MOVE_RATE) + 1) / _MOVE_RATE)
    return Trajectory(_MOVE_RATE, motion.displacement, motion.velocity, motion.acceleration)


class SoftStop(NamedTuple):
    """Deceleration of a trajectory's own time to zero."""

    start: float
    """[s] Begin of the stop on the trajectory's time."""
    duration: float
    """[s] Time until standstill; the trajectory's time advances by half of it."""


@dataclass(frozen=True)
class ScheduledTrajectory:
    """Trajectory with its begin on the bench clock and, if one was requested, a soft stop."""

    trajectory: Trajectory
    begin_ns: int
    """Bench clock at the begin of the trajectory [ns]."""
    soft_stop: SoftStop | None = None

    def map_time(self, time_ns: Times) -> Array:
        """Convert instants of the bench clock [ns] to the trajectory's time [s]."""
        elapsed = np.asarray((time_ns - self.begin_ns) * 1e-9, dtype=np.float64)
        return elapsed if self.soft_stop is None else _slow_down(elapsed, self.soft_stop)[0]

    def find_positions(self, time_ns: Times) -> Array:
        """Return the demanded positions [m] at instants of the bench clock [ns]."""
        return self.trajectory.interpolate(self.trajectory.displacement, self.map_time(time_ns))

    def find_position(self, time_ns: int) -> float:
        """Return the demanded position [m] at one instant [ns], fast enough for every cycle."""
        if self.soft_stop is not None:
            return float(self.find_positions(np.array([time_ns]))[0])
        trajectory = self.trajectory
        position = min(max((time_ns - self.begin_ns) * 1e-9, 0.0), trajectory.duration) * trajectory.rate
        before = min(int(position), max(len(trajectory.displacement) - 2, 0))
        after = min(before + 1, len(trajectory.displacement) - 1)
        low, high = trajectory.displacement.item(before), trajectory.displacement.item(after)
        return low + (position - before) * (high - low)

    @property
    def end_ns(self) -> int:
        """Bench clock of the end of the motion [ns]."""
        duration = self.trajectory.duration
        if self.soft_stop is not None and self.soft_stop.start < duration:
            duration = self.soft_stop.start + self.soft_stop.duration
        return self.begin_ns + round(duration * 1e9)

    def add_soft_stop(self, at_ns: int, acceleration: float) -> "ScheduledTrajectory":
        """Return the trajectory with a soft stop; a second stop changes nothing, as it would delay the standstill.

        Args:
            at_ns: begin of the stop on the bench clock [ns]; after all setpoints that were already sent.
            acceleration: limit [m/s²]; exceeded only if even the longest stop exceeds it.
        """
        if self.soft_stop is not None:
            return self
        start = max((at_ns - self.begin_ns) * 1e-9, 0.0)
        duration = next(
            (one for one in STOP_TIMES if self._find_peak_acceleration(SoftStop(start, one)) <= acceleration),
            STOP_TIMES[-1],
        )
        return replace(self, soft_stop=SoftStop(start, duration))

    def _find_peak_acceleration(self, stop: SoftStop) -> float:
        """Return the largest acceleration [m/s²] during a soft stop."""
        elapsed = stop.start + np.linspace(0.0, stop.duration, _STOP_SAMPLES)
        time, time_rate, time_acceleration = _slow_down(elapsed, stop)
        velocity = self.trajectory.interpolate(self.trajectory.velocity, time)
        acceleration = self.trajectory.interpolate(self.trajectory.acceleration, time)
        return float(np.max(np.abs(acceleration * time_rate**2 + velocity * time_acceleration)))


def _slow_down(elapsed: Array, stop: SoftStop) -> tuple[Array, Array, Array]:
    """Return the trajectory's time [s], its rate [1] and its acceleration [1/s] at times since the begin [s]."""
    # The rate is a raised cosine from 1 to 0, so that neither velocity nor acceleration jumps.
    share = np.clip((elapsed - stop.start) / stop.duration, 0.0, 1.0)
    time_rate = (1 + np.cos(np.pi * share)) / 2
    advance = stop.duration * (share + np.sin(np.pi * share) / np.pi) / 2
    time = np.where(elapsed < stop.start, elapsed, stop.start + advance)
    time_acceleration = -np.pi / (2 * stop.duration) * np.sin(np.pi * share)
    return time, time_rate, time_acceleration

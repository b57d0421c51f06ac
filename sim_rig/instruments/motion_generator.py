"""Motion generator of the simulated servo drive: demanded position, interpolated, extrapolated, then braked.

Setpoints arrive once per interpolation period, with the jitter of the host. A drive locked to SYNC does not pass
that jitter on to the rod. A host can be late but never early, so the drive's sync grid follows the earliest SYNCs,
one slot for each. The demand goes linearly from setpoint to setpoint and reaches each one four periods after its
slot. If a setpoint is late by more than three periods, the demand is extrapolated at the velocity of the last two
for two further periods. Then the drive brakes. Once the setpoint after a linear move is known, the move is
replaced by a cubic: with corners every 4 ms the rod would vibrate at 250 Hz. Positions are in metres, times in ns;
the module uses no bus.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

_EXTRAPOLATION_PERIODS = 2
"""Periods for which the velocity of the setpoints is kept after the last one was reached."""
_BUFFER_PERIODS = 4
"""Periods from a setpoint's slot until it is reached: one for the move, three of tolerated lateness."""
_SYNC_HISTORY = 128
"""Number of SYNCs of which the earliest defines the grid."""
_TRACKING_GAIN = 1 / 16
"""Fraction of the grid's error that is corrected with each SYNC [1]."""
_CURVE_PARTS = 4
"""Number of linear moves that approximate a cubic."""
_LENGTH_TOLERANCE = 0.1
"""Largest relative difference in duration of adjacent moves for which a cubic is used [1]."""
_MAX_LATE_PERIODS = 4
"""Limit on the lateness of a SYNC [periods]: beyond it, the grid restarts."""
_MAX_REST_PERIODS = 0.5
"""Limit on the lateness of a SYNC at rest [periods]: a host that paused is not late, and a restart is harmless."""


class MotionState(Enum):
    """State of the demand."""

    REST = "rest"
    FOLLOW = "follow"
    EXTRAPOLATE = "extrapolate"
    BRAKE = "brake"
    MOVE = "move"


class LinearMove(NamedTuple):
    """Linear part of the demanded motion."""

    begin_ns: int
    """Start [ns], at the end of the previous one."""
    end_ns: int
    """End [ns]."""
    target: float
    """Position at the end [m]."""


class _SyncGrid:
    """Slots of the SYNCs, one period apart, aligned with the earliest of the last ones."""

    def __init__(self, arrival_ns: int, period_ns: int) -> None:
        self._period_ns, self._count, self._origin_ns = period_ns, 0, arrival_ns
        self._origins = deque([arrival_ns], _SYNC_HISTORY)

    def assign_slot(self, arrival_ns: int) -> int:
        """Return the slot [ns] of the next SYNC, which arrived at ``arrival_ns`` [ns]."""
        self._count += 1
        since_ns = self._count * self._period_ns
        self._origins.append(arrival_ns - since_ns)
        # With their mean, the motion differed by 25 to 210 µm from cycle to cycle; with the earliest, by 9 µm.
        self._origin_ns += round((min(self._origins) - self._origin_ns) * _TRACKING_GAIN)
        return self._origin_ns + since_ns


@dataclass
class MotionGenerator:
    """Demanded position of the drive."""

    position: float = 0.0
    """[m]"""
    velocity: float = 0.0
    """[m/s]"""
    state: MotionState = MotionState.REST
    _now_ns: int = 0
    _previous: tuple[int, float] = (0, 0.0)
    _last: tuple[int, float] = (0, 0.0)
    """Slots [ns] and positions [m] of the last two setpoints."""
    _grid: _SyncGrid = field(default_factory=lambda: _SyncGrid(0, 1))
    _extrapolation_end_ns: int = 0
    _target: float = 0.0
    _setpoint_velocity: float = 0.0
    _deceleration: float = 1.0
    _queue: deque[tuple[int, float]] = field(default_factory=deque)
    """Instant [ns] at which each setpoint is reached, and its position [m]."""
    _recent_setpoints: deque[tuple[int, float]] = field(default_factory=lambda: deque(maxlen=4))
    """The last four entries of the queue, reached or not."""

    def add_setpoint(
        self, target: float, arrival_ns: int, period_ns: int, max_speed: float, deceleration: float
    ) -> list[LinearMove]:
        """Add a setpoint.

        Args:
            target: [m]
            arrival_ns: instant of its SYNC [ns]; it may be before the instant to which the demand has advanced.
            period_ns: between setpoints [ns].
            max_speed: [m/s] limit for the approach.
            deceleration: [m/s²] for braking if no further setpoint arrives.

        Returns:
            The move to the setpoint, preceded by the new cubic of the move before it, if that is replaced.
        """
        if self.state not in (MotionState.FOLLOW, MotionState.EXTRAPOLATE) or self._is_sync_lost(
            arrival_ns, period_ns
        ):
            self._queue.clear()
            self._recent_setpoints.clear()
            self._previous = arrival_ns - period_ns, self.position
            self._grid = _SyncGrid(arrival_ns, period_ns)
            self._last = arrival_ns, target
        else:
            self._previous, self._last = self._last, (self._grid.assign_slot(arrival_ns), target)
        (last_slot, last_target), (slot, _) = self._previous, self._last
        span = (slot - last_slot) / 1e9
        self._setpoint_velocity = min(max((target - last_target) / span, -max_speed), max_speed)
        # Never reached in the past, even if it was late: the rod cannot jump.
        reached = max(slot + _BUFFER_PERIODS * period_ns, self._now_ns + period_ns // 4)
        begin = self._queue[-1][0] if self._queue else self._now_ns
        self._queue.append((reached, last_target + self._setpoint_velocity * span))
        self.state, self._deceleration = MotionState.FOLLOW, deceleration
        self._extrapolation_end_ns = reached + _EXTRAPOLATION_PERIODS * period_ns
        self._update_velocity()
        self._recent_setpoints.append(self._queue[-1])
        return [*self._interpolate_last(), LinearMove(begin, *self._queue[-1])]

    def _interpolate_last(self) -> list[LinearMove]:
        """Return the second to last move as a cubic through its neighbours (Catmull-Rom), unless it began."""
        if len(self._recent_setpoints) < 4 or self._recent_setpoints[1][0] < self._now_ns:
            return []
        times = [at for at, _ in self._recent_setpoints]
        positions = [position for _, position in self._recent_setpoints]
        begin, length = times[1], times[2] - times[1]
        # The formula requires moves of equal duration.
        if max(abs(times[1] - times[0] - length), abs(times[3] - times[2] - length)) > _LENGTH_TOLERANCE * length:
            return []
        moves, last = [], begin
        for part in range(1, _CURVE_PARTS + 1):
            u = part / _CURVE_PARTS
            end = begin + round(u * length)
            moves.append(LinearMove(last, end, _evaluate_catmull_rom(positions, u)))
            last = end
        return moves

    def _is_sync_lost(self, arrival_ns: int, period_ns: int) -> bool:
        """Return whether the grid must restart with this SYNC."""
        limit = _MAX_LATE_PERIODS if self._setpoint_velocity else _MAX_REST_PERIODS
        return arrival_ns - self._last[0] - period_ns > limit * period_ns

    def _update_velocity(self) -> None:
        """Set the velocity towards the next setpoint."""
        reached, target = self._queue[0]
        self.velocity = (target - self.position) / max((reached - self._now_ns) / 1e9, 1e-9)

    def brake(self, deceleration: float) -> None:
        """Brake to rest at ``deceleration`` [m/s²]."""
        self._queue.clear()
        if self.state is not MotionState.REST:
            self.state, self._deceleration = MotionState.BRAKE, deceleration

    def move_to(self, target: float, speed: float) -> None:
        """Move to ``target`` [m] at ``speed`` [m/s] and stay there."""
        self._queue.clear()
        self.state, self._target = MotionState.MOVE, target
        self.velocity = speed if target > self.position else -speed

    def hold_at(self, position: float) -> None:
        """Hold ``position`` [m]."""
        self._queue.clear()
        self.position, self.velocity, self.state = position, 0.0, MotionState.REST

    def advance(self, now_ns: int) -> None:
        """Advance the demand to ``now_ns`` [ns]."""
        while self._queue and now_ns >= self._queue[0][0]:
            reached, self.position = self._queue.popleft()
            self._now_ns = max(reached, self._now_ns)
            if self._queue:
                self._update_velocity()
            else:
                self.state, self.velocity = MotionState.EXTRAPOLATE, self._setpoint_velocity
        if self.state is MotionState.EXTRAPOLATE and now_ns > self._extrapolation_end_ns:
            self._move(self._extrapolation_end_ns)
            self.state = MotionState.BRAKE
        self._move(now_ns)

    def _move(self, now_ns: int) -> None:
        dt = max(now_ns - self._now_ns, 0) / 1e9
        self._now_ns = max(now_ns, self._now_ns)
        if self.state in (MotionState.FOLLOW, MotionState.EXTRAPOLATE):
            self.position += self.velocity * dt
        elif self.state is MotionState.BRAKE:
            self._decelerate(dt)
        elif self.state is MotionState.MOVE:
            step = self.velocity * dt
            if abs(self._target - self.position) <= abs(step):
                self.hold_at(self._target)
            else:
                self.position += step

    def _decelerate(self, dt: float) -> None:
        stopping = min(dt, abs(self.velocity) / self._deceleration)
        change = -self._deceleration * stopping if self.velocity > 0 else self._deceleration * stopping
        self.position += (self.velocity + change / 2) * stopping
        self.velocity += change
        if stopping < dt:
            self.hold_at(self.position)


def _evaluate_catmull_rom(points: Sequence[float], u: float) -> float:
    """Return the cubic between the second and third of four points, ``u`` from 0 to 1."""
    a, b, c, d = points
    return b + u * ((c - a) / 2 + u * (a - 2.5 * b + 2 * c - d / 2 + u * (1.5 * (b - c) + (d - a) / 2)))

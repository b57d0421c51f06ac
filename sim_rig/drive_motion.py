"""Where a servo drive wants the rod to be: setpoints interpolated, run on for a moment, then braked.

Setpoints come once an interpolation period, as punctually as their host is. A drive that is locked to SYNC does
not pass that jitter on to its machine: a host can be late but never early, so the drive's own grid of periods
follows the earliest SYNCs, one place for each, and the demand goes straight from one setpoint to the next, reached
four periods after its place. One that is late by more than three is bridged at the pace of the last two for two
further periods; then the drive brakes. Once the setpoint behind a leg is known, the leg is bent into a cubic: with
corners every 4 ms the rod would shake at 250 Hz. Positions are in metres, times in ns; nothing here knows a bus.
"""

from collections import deque
from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

_BRIDGED = 2
"""Periods for which the pace of the setpoints is kept after the last one was reached."""
_BEHIND = 4
"""Periods from a setpoint's place on the grid until it is reached: one to go there, three to come late."""
_REMEMBERED = 128
"""SYNCs of which the earliest tells where the grid stands."""
_PULL = 1 / 16
"""Share of what is missing to it by which the grid moves with each SYNC."""
_PARTS = 4
"""Straight parts that a bent leg is cut into."""
_EVEN = 0.1
"""Share of a leg by which the ones beside it may be longer or shorter for it to be bent."""
_MISSED = 4
"""Periods that a SYNC may be late; with one that is later the grid begins anew."""
_SILENT = 0.5
"""The same while the rod stands, when nothing is lost by it: a host that was silent for a period is not late."""


class Motion(Enum):
    """What the demand does."""

    REST = "rest"
    FOLLOW = "follow"
    BRIDGE = "bridge"
    BRAKE = "brake"
    TRAVEL = "travel"


class Leg(NamedTuple):
    """A straight piece of the way."""

    begin_ns: int
    """When it begins, where the one before it ends [ns]."""
    end_ns: int
    """[ns]"""
    target: float
    """Where it ends [m]."""


class _Grid:
    """Places of the SYNCs, a period apart, where the earliest of the last ones came."""

    def __init__(self, came_ns: int, period_ns: int) -> None:
        self._period_ns, self._count, self._origin_ns = period_ns, 0, came_ns
        self._origins = deque([came_ns], _REMEMBERED)

    def place(self, came_ns: int) -> int:
        """Of the next SYNC [ns], which came at ``came_ns`` [ns]."""
        self._count += 1
        since_ns = self._count * self._period_ns
        self._origins.append(came_ns - since_ns)
        # By the mean of them, the motion differed by 25 to 210 µm from cycle to cycle; by the earliest, by 9 µm.
        self._origin_ns += round((min(self._origins) - self._origin_ns) * _PULL)
        return self._origin_ns + since_ns


@dataclass
class Demand:
    """The demanded position of the drive."""

    position: float = 0.0
    """[m]"""
    velocity: float = 0.0
    """[m/s]"""
    motion: Motion = Motion.REST
    _now_ns: int = 0
    _before: tuple[int, float] = (0, 0.0)
    _last: tuple[int, float] = (0, 0.0)
    """Places on the grid [ns] of the last two setpoints, and these [m]."""
    _grid: _Grid = field(default_factory=lambda: _Grid(0, 1))
    _bridged_ns: int = 0
    _target: float = 0.0
    _pace: float = 0.0
    _deceleration: float = 1.0
    _ahead: deque[tuple[int, float]] = field(default_factory=deque)
    """When each setpoint is to be reached [ns], and the setpoint [m]."""
    _way: deque[tuple[int, float]] = field(default_factory=lambda: deque(maxlen=4))
    """The same of the last four, reached or not."""

    def follow(
        self, target: float, came_ns: int, period_ns: int, top_speed: float, deceleration: float
    ) -> list[Leg]:
        """Take a setpoint.

        Args:
            target: [m]
            came_ns: when its SYNC passed [ns]; may lie before the instant to which the demand has moved.
            period_ns: between setpoints [ns].
            top_speed: [m/s] at which it is approached at most.
            deceleration: [m/s²] for braking, should no other follow.

        Returns:
            The way on which it is reached, and before it the leg before anew, where that is bent.
        """
        if self.motion not in (Motion.FOLLOW, Motion.BRIDGE) or self._is_lost(came_ns, period_ns):
            self._ahead.clear()
            self._way.clear()
            self._before = came_ns - period_ns, self.position
            self._grid = _Grid(came_ns, period_ns)
            self._last = came_ns, target
        else:
            self._before, self._last = self._last, (self._grid.place(came_ns), target)
        (began, before), (place, _) = self._before, self._last
        span = (place - began) / 1e9
        self._pace = min(max((target - before) / span, -top_speed), top_speed)
        # However late it came, it is reached from now on only: a rod cannot leap.
        reached = max(place + _BEHIND * period_ns, self._now_ns + period_ns // 4)
        begin = self._ahead[-1][0] if self._ahead else self._now_ns
        self._ahead.append((reached, before + self._pace * span))
        self.motion, self._deceleration = Motion.FOLLOW, deceleration
        # Should no other come: on at this pace for a while, then braked.
        self._bridged_ns = reached + _BRIDGED * period_ns
        self._head_on()
        self._way.append(self._ahead[-1])
        return [*self._bent(), Leg(begin, *self._ahead[-1])]

    def _bent(self) -> list[Leg]:
        """The last leg but one through the setpoints around it (Catmull and Rom), if the rod is not yet on it."""
        if len(self._way) < 4 or self._way[1][0] < self._now_ns:
            return []
        times, (a, b, c, d) = [at for at, _ in self._way], [position for _, position in self._way]
        begin, length = times[1], times[2] - times[1]
        # The formula is that of legs of one length.
        if max(abs(times[1] - times[0] - length), abs(times[3] - times[2] - length)) > _EVEN * length:
            return []
        legs, last = [], begin
        for part in range(1, _PARTS + 1):
            u = part / _PARTS
            bent = b + u * ((c - a) / 2 + u * (a - 2.5 * b + 2 * c - d / 2 + u * (1.5 * (b - c) + (d - a) / 2)))
            end = begin + round(u * length)
            legs.append(Leg(last, end, bent))
            last = end
        return legs

    def _is_lost(self, came_ns: int, period_ns: int) -> bool:
        """Whether the grid has to begin anew with this SYNC."""
        patience = _MISSED if self._pace else _SILENT
        return came_ns - self._last[0] - period_ns > patience * period_ns

    def _head_on(self) -> None:
        """The velocity towards the next setpoint."""
        reached, target = self._ahead[0]
        self.velocity = (target - self.position) / max((reached - self._now_ns) / 1e9, 1e-9)

    def brake(self, deceleration: float) -> None:
        """Come to rest at ``deceleration`` [m/s²]."""
        self._ahead.clear()
        if self.motion is not Motion.REST:
            self.motion, self._deceleration = Motion.BRAKE, deceleration

    def travel(self, target: float, speed: float) -> None:
        """Go to ``target`` [m] at ``speed`` [m/s] and stay there."""
        self._ahead.clear()
        self.motion, self._target = Motion.TRAVEL, target
        self.velocity = speed if target > self.position else -speed

    def rest(self, position: float) -> None:
        """Stand at ``position`` [m]."""
        self._ahead.clear()
        self.position, self.velocity, self.motion = position, 0.0, Motion.REST

    def advance(self, now_ns: int) -> None:
        """Move on to ``now_ns``."""
        while self._ahead and now_ns >= self._ahead[0][0]:
            reached, self.position = self._ahead.popleft()
            self._now_ns = max(reached, self._now_ns)
            if self._ahead:
                self._head_on()
            else:
                self.motion, self.velocity = Motion.BRIDGE, self._pace
        if self.motion is Motion.BRIDGE and now_ns > self._bridged_ns:
            self._move(self._bridged_ns)
            self.motion = Motion.BRAKE
        self._move(now_ns)

    def _move(self, now_ns: int) -> None:
        dt = max(now_ns - self._now_ns, 0) / 1e9
        self._now_ns = max(now_ns, self._now_ns)
        if self.motion in (Motion.FOLLOW, Motion.BRIDGE):
            self.position += self.velocity * dt
        elif self.motion is Motion.BRAKE:
            self._slow_down(dt)
        elif self.motion is Motion.TRAVEL:
            step = self.velocity * dt
            if abs(self._target - self.position) <= abs(step):
                self.rest(self._target)
            else:
                self.position += step

    def _slow_down(self, dt: float) -> None:
        stopping = min(dt, abs(self.velocity) / self._deceleration)
        change = -self._deceleration * stopping if self.velocity > 0 else self._deceleration * stopping
        self.position += (self.velocity + change / 2) * stopping
        self.velocity += change
        if stopping < dt:
            self.rest(self.position)

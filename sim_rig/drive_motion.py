"""Where a servo drive wants the rod to be: setpoints interpolated, run on for a moment, then braked.

Setpoints come once an interpolation period, as punctually as their host is. A drive that is locked to SYNC does
not pass that jitter on to its machine: its own grid of periods follows the usual place of the SYNCs, and the
demand goes straight from one to the next, each reached three periods after its place on the grid. One that is late
by more than two is bridged at the pace of the last two for two further periods; then the drive brakes.
Positions are in metres, times in nanoseconds, and nothing here knows a bus.
"""

from collections import deque
from dataclasses import dataclass, field
from enum import Enum

_BRIDGED = 2
"""Periods for which the pace of the setpoints is kept after the last one was reached."""
_BEHIND = 3
"""Periods from a setpoint's place on the grid until it is reached: one to go there, two to come late."""
_PULL = 1 / 32
"""Share of a SYNC's lateness by which the grid follows it; more at first: it begins at the mean of many."""
_PUNCTUAL = 1 / 20
"""Of a period: what is later or earlier pulls no more than that, or a host that stumbles moves the machine."""
_MISSED = 4
"""Periods of silence after which the grid begins anew."""


class Motion(Enum):
    """What the demand does."""

    REST = "rest"
    FOLLOW = "follow"
    BRIDGE = "bridge"
    BRAKE = "brake"
    TRAVEL = "travel"


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
    _heard: int = 0
    """SYNCs since the grid began."""
    _bridged_ns: int = 0
    _target: float = 0.0
    _pace: float = 0.0
    _deceleration: float = 1.0
    _ahead: deque[tuple[int, float]] = field(default_factory=deque)
    """When each setpoint is to be reached [ns], and the setpoint [m]."""

    def follow(self, target: float, period_ns: int, top_speed: float, deceleration: float) -> None:
        """Take a setpoint [m] that has come now, to be approached at no more than ``top_speed`` [m/s]."""
        if self.motion not in (Motion.FOLLOW, Motion.BRIDGE) or self._is_lost(period_ns):
            self._ahead.clear()
            self._before = self._now_ns - period_ns, self.position
            self._last, self._heard = (self._now_ns, target), 1
        else:
            self._place(target, period_ns)
        (began, before), (place, _) = self._before, self._last
        span = (place - began) / 1e9
        self._pace = min(max((target - before) / span, -top_speed), top_speed)
        reached = max(place + _BEHIND * period_ns, self._now_ns + period_ns // 4)
        self._ahead.append((reached, before + self._pace * span))
        self.motion, self._deceleration = Motion.FOLLOW, deceleration
        self._bridged_ns = reached + _BRIDGED * period_ns
        self._head_on()

    def _is_lost(self, period_ns: int) -> bool:
        """Whether the grid has to begin anew with this SYNC."""
        return not 0 <= self._now_ns - self._last[0] <= _MISSED * period_ns

    def _place(self, target: float, period_ns: int) -> None:
        """Give a setpoint its place on the grid, and pull the grid a little towards its SYNC.

        One that comes soon after a late one, which was taken for it, tells that the late one belonged before.
        """
        place, last = self._last
        periods = round((self._now_ns - place) / period_ns)
        if periods:
            self._before = place, last
        elif self._ahead:
            reached, wrongly_placed = self._ahead.pop()
            if reached - period_ns > self._now_ns:
                self._ahead.append((reached - period_ns, wrongly_placed))
            self._before = place - period_ns, last
        place += periods * period_ns
        self._last = place + self._pull(self._now_ns - place, period_ns), target

    def _pull(self, late_ns: int, period_ns: int) -> int:
        """By how much a SYNC that is late moves the grid [ns]."""
        self._heard += 1
        most = period_ns * (_PUNCTUAL if self._heard * _PULL > 1 else 1)
        return round(max(min(late_ns, most), -most) * max(1 / self._heard, _PULL))

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

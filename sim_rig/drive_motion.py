"""Where a servo drive wants the rod to be: setpoints interpolated, run on for a moment, then braked.

Between setpoints the demand goes straight to the newest one within the interpolation period. A setpoint that is
late is bridged at the pace of the last two for two further periods; after that the drive brakes by itself.
Positions are in metres, times in nanoseconds, and nothing here knows a bus.
"""

from dataclasses import dataclass
from enum import Enum

_BRIDGED = 2
"""Periods for which the pace of the setpoints is kept after the last one was reached."""


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
    _until_ns: int = 0
    _bridged_ns: int = 0
    _target: float = 0.0
    _pace: float = 0.0
    _deceleration: float = 1.0

    def follow(self, target: float, period_ns: int, top_speed: float, deceleration: float) -> None:
        """Take a setpoint [m], to be reached after one period at no more than ``top_speed`` [m/s]."""
        period = period_ns / 1e9
        led = self.motion in (Motion.FOLLOW, Motion.BRIDGE)
        before = self._target if led else self.position
        self._pace = min(max((target - before) / period, -top_speed), top_speed)
        self.velocity = min(max((target - self.position) / period, -top_speed), top_speed)
        self.motion, self._deceleration, self._target = Motion.FOLLOW, deceleration, target
        self._until_ns, self._bridged_ns = self._now_ns + period_ns, self._now_ns + (1 + _BRIDGED) * period_ns

    def brake(self, deceleration: float) -> None:
        """Come to rest at ``deceleration`` [m/s²]."""
        if self.motion is not Motion.REST:
            self.motion, self._deceleration = Motion.BRAKE, deceleration

    def travel(self, target: float, speed: float) -> None:
        """Go to ``target`` [m] at ``speed`` [m/s] and stay there."""
        self.motion, self._target = Motion.TRAVEL, target
        self.velocity = speed if target > self.position else -speed

    def rest(self, position: float) -> None:
        """Stand at ``position`` [m]."""
        self.position, self.velocity, self.motion = position, 0.0, Motion.REST

    def advance(self, now_ns: int) -> None:
        """Move on to ``now_ns``."""
        if self.motion is Motion.FOLLOW and now_ns > self._until_ns:
            self._move(self._until_ns)
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

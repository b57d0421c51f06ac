"""Commands that arrive at any instant, evaluated at the samples of the plant."""

from collections import deque

import numpy as np

from sim_rig.live.interface import TimeArray
from sim_rig.plant import Array

_ALWAYS_NS = -(2**62)
"""[ns] instant of the first command: before any other."""


class ZeroOrderHold:
    """Signal that keeps each command until the next: the amplifier's drive."""

    def __init__(self, value: float) -> None:
        """Start with a constant value."""
        self._points: deque[tuple[int, float]] = deque([(_ALWAYS_NS, value)])

    def add(self, at_ns: int, value: float) -> None:
        """Add a command at an instant [ns], not before the last one."""
        self._points.append((at_ns, value))

    def evaluate(self, instants: TimeArray) -> Array:
        """Return the (N,) values at increasing instants [ns]; earlier commands are then discarded."""
        times = np.array([at for at, _ in self._points])
        commands = np.array([value for _, value in self._points])
        values = commands[np.searchsorted(times, instants, side="right") - 1]
        _discard_before(self._points, instants)
        return np.asarray(values)


class LinearInterpolator:
    """Signal that reaches each command by a straight line within a fixed time: the demand of the actuator.

    A command of instant t is reached at t + transition. Its line begins where the command before it was reached,
    or at t if that is later. Frequent commands are therefore followed exactly but delayed, and no command acts
    before it arrived. A motion that is known in advance may be commanded in advance and may be replaced.
    """

    def __init__(self, value: float, transition_ns: int) -> None:
        """Start with a constant value; ``transition_ns`` [ns] is above 0."""
        self._transition_ns = transition_ns
        self._vertices: deque[tuple[int, float]] = deque([(_ALWAYS_NS, value)])

    def add(self, at_ns: int, value: float, since_ns: int | None = None) -> None:
        """Add a command at an instant [ns]; it replaces commands for later instants.

        Args:
            at_ns: on the rig's clock [ns].
            value: to be reached.
            since_ns: [ns] start of the straight line to it; None if it was not known before ``at_ns``.
        """
        end = at_ns + self._transition_ns
        while len(self._vertices) > 1 and self._vertices[-1][0] >= end:
            self._vertices.pop()
        reached, last = self._vertices[-1]
        begin = at_ns if since_ns is None else since_ns + self._transition_ns
        if begin > reached:  # constant in between
            self._vertices.append((begin, last))
        # At least one nanosecond later: `interp` needs increasing instants.
        self._vertices.append((max(end, reached + 1), value))

    def evaluate(self, instants: TimeArray) -> Array:
        """Return the (N,) demand at increasing instants [ns]; earlier commands are then discarded."""
        times = [at for at, _ in self._vertices]
        values = np.interp(instants, times, [value for _, value in self._vertices])
        _discard_before(self._vertices, instants)
        return np.asarray(values, dtype=np.float64)


def _discard_before(points: deque[tuple[int, float]], instants: TimeArray) -> None:
    """Remove the points that no instant after the last of these needs."""
    if len(instants):
        while len(points) > 1 and points[1][0] <= instants[-1]:
            points.popleft()

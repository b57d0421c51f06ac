"""Commands that come at any instant, as the plant takes them at its samples."""

from collections import deque

import numpy as np
import numpy.typing as npt

from sim_rig.compiled import Array

Instants = npt.NDArray[np.int64]
"""On the rig's clock [ns]."""


class HeldTrack:
    """Each command stands until the next: the amplifier's drive."""

    def __init__(self, value: float) -> None:
        """Begin with a value that has always stood."""
        self._points: deque[tuple[int, float]] = deque([(-(2**62), value)])

    def add(self, at_ns: int, value: float) -> None:
        """A command at an instant [ns], not before the last one."""
        self._points.append((at_ns, value))

    def at(self, instants: Instants) -> Array:
        """(N,) what stands at increasing instants [ns]; what came before the last of them is forgotten."""
        times = np.array([at for at, _ in self._points])
        values = np.array([value for _, value in self._points])
        found = values[np.searchsorted(times, instants, side="right") - 1]
        if len(instants):
            while len(self._points) > 1 and self._points[1][0] <= instants[-1]:
                self._points.popleft()
        return np.asarray(found)


class JoinedTrack:
    """Commands joined by straight lines: the demand of the actuator, which takes up each over a short time.

    A command of instant t is reached at t + take_up, on a line that begins where the one before it was reached, or
    at t if that is later. So commands that come often enough are followed as they were meant, only later, and none
    is followed before it came. A way that is known beforehand is commanded beforehand, and may be taken back.
    """

    def __init__(self, value: float, take_up_ns: int) -> None:
        """Begin with a value that has always stood; ``take_up_ns`` [ns] is above 0."""
        self._take_up = take_up_ns
        self._vertices: deque[tuple[int, float]] = deque([(-(2**62), value)])

    def add(self, at_ns: int, value: float, since_ns: int | None = None) -> None:
        """A command at an instant [ns]; those of later instants are taken back.

        Args:
            at_ns: on the rig's clock [ns].
            value: to be reached.
            since_ns: from when on [ns] the way leads straight there; none where none was known before ``at_ns``.
        """
        end = at_ns + self._take_up
        while len(self._vertices) > 1 and self._vertices[-1][0] >= end:
            self._vertices.pop()
        reached, last = self._vertices[-1]
        begin = at_ns if since_ns is None else since_ns + self._take_up
        if begin > reached:  # it stood meanwhile
            self._vertices.append((begin, last))
        # By a nanosecond at least: `interp` needs instants that increase.
        self._vertices.append((max(end, reached + 1), value))

    def at(self, instants: Instants) -> Array:
        """(N,) where the demand is at increasing instants [ns]; what came before the last of them is forgotten."""
        times = [at for at, _ in self._vertices]
        found = np.interp(instants, times, [value for _, value in self._vertices])
        if len(instants):
            while len(self._vertices) > 1 and self._vertices[1][0] <= instants[-1]:
                self._vertices.popleft()
        return np.asarray(found, dtype=np.float64)

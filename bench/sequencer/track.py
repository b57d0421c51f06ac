"""What the rod is to do at any instant: a motion on its own time, played from some moment of the bench clock on.

Pure functions of time. The thread that sends setpoints asks them for one instant, the recorder for many at once;
both get the same answer. A stop does not break the motion off: its own time runs slower and slower until it
stands, so the rod stays on its path, no faster than it was.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from bench.methods.kinematics import move, move_duration

Array = npt.NDArray[np.float64]
Times = npt.NDArray[np.int64]

MOVE_VELOCITY, MOVE_ACCELERATION = 0.03, 0.3
"""[m/s], [m/s²] of the way to where a method begins."""
FADES = (0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)
"""[s] lengths of a stop; the first that keeps the acceleration is taken."""
_MOVE_RATE = 1000.0
"""[Hz] of a motion that no method has sampled; setpoints lie between its samples."""
_FINE = 200
"""Instants of a fade at which its acceleration is looked at."""


@dataclass(frozen=True)
class Track:
    """A motion, uniformly sampled, each array of shape (samples,); at rest before it begins and after it ends."""

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
        """[s] from the first sample to the last."""
        return (len(self.displacement) - 1) / self.rate

    def at(self, values: Array, time: Array) -> Array:
        """One of its columns at times [s] from its begin, straight between samples, still outside."""
        place = np.clip(time, 0.0, self.duration) * self.rate
        before = np.minimum(place.astype(np.int64), max(len(values) - 2, 0))
        after = np.minimum(before + 1, len(values) - 1)
        return np.asarray(values[before] + (place - before) * (values[after] - values[before]))


def standing(position: float) -> Track:
    """No motion, at ``position`` [m]."""
    still = np.zeros(1)
    return Track(_MOVE_RATE, np.array([position]), still, still)


def approach(start: float, end: float) -> Track:
    """A soft way from rest at ``start`` to rest at ``end`` [m]."""
    if start == end:
        return standing(end)
    duration = move_duration(end - start, MOVE_VELOCITY, MOVE_ACCELERATION)
    motion = move(start, end, duration, np.arange(round(duration * _MOVE_RATE) + 1) / _MOVE_RATE)
    return Track(_MOVE_RATE, motion.displacement, motion.velocity, motion.acceleration)


class Fade(NamedTuple):
    """A stop."""

    at: float
    """[s] on the track's time where it begins."""
    lasts: float
    """[s] until the motion stands; half as much of the track's time goes by."""


@dataclass(frozen=True)
class Playing:
    """A track from some moment on."""

    track: Track
    begin_ns: int
    """Bench clock at the track's begin [ns]."""
    fade: Fade | None = None

    def place(self, time_ns: Times) -> Array:
        """How far the track's own time is at instants of the bench clock [s]."""
        elapsed = np.asarray((time_ns - self.begin_ns) * 1e-9, dtype=np.float64)
        return elapsed if self.fade is None else _slowed(elapsed, self.fade)[0]

    def positions(self, time_ns: Times) -> Array:
        """Where the rod is to be at instants of the bench clock [m]."""
        return self.track.at(self.track.displacement, self.place(time_ns))

    def position(self, time_ns: int) -> float:
        """Where the rod is to be at one instant [m]: `positions`, quick enough for every cycle."""
        if self.fade is not None:
            return float(self.positions(np.array([time_ns]))[0])
        track = self.track
        place = min(max((time_ns - self.begin_ns) * 1e-9, 0.0), track.duration) * track.rate
        before = min(int(place), max(len(track.displacement) - 2, 0))
        after = min(before + 1, len(track.displacement) - 1)
        low, high = track.displacement.item(before), track.displacement.item(after)
        return low + (place - before) * (high - low)

    @property
    def end_ns(self) -> int:
        """Bench clock from which on nothing moves any more [ns]."""
        lasts = self.track.duration
        if self.fade is not None and self.fade.at < lasts:
            lasts = self.fade.at + self.fade.lasts
        return self.begin_ns + round(lasts * 1e9)

    def stopped(self, at_ns: int, acceleration: float) -> "Playing":
        """The same, but fading out from an instant on.

        Args:
            at_ns: bench clock [ns]; setpoints that have left already must lie before it.
            acceleration: [m/s²] that the fade keeps below, unless even the longest one does not.
        """
        # A second stop changes nothing: to begin the fade anew would only make it longer.
        if self.fade is not None:
            return self
        at = max((at_ns - self.begin_ns) * 1e-9, 0.0)
        lasts = next((one for one in FADES if self._peak(Fade(at, one)) <= acceleration), FADES[-1])
        return replace(self, fade=Fade(at, lasts))

    def _peak(self, fade: Fade) -> float:
        """Largest acceleration [m/s²] within a fade: of a motion along its path, slowed."""
        elapsed = fade.at + np.linspace(0.0, fade.lasts, _FINE)
        place, pace, change = _slowed(elapsed, fade)
        velocity = self.track.at(self.track.velocity, place)
        within = self.track.at(self.track.acceleration, place)
        return float(np.max(np.abs(within * pace**2 + velocity * change)))


def _slowed(elapsed: Array, fade: Fade) -> tuple[Array, Array, Array]:
    """Track time [s], its rate [1] and the change of that [1/s] at times since the begin [s]: a raised cosine."""
    # From 1 to 0, so that neither velocity nor acceleration jumps; `way` is the integral of the pace.
    share = np.clip((elapsed - fade.at) / fade.lasts, 0.0, 1.0)
    pace = (1 + np.cos(np.pi * share)) / 2
    way = fade.lasts * (share + np.sin(np.pi * share) / np.pi) / 2
    place = np.where(elapsed < fade.at, elapsed, fade.at + way)
    change = -np.pi / (2 * fade.lasts) * np.sin(np.pi * share)
    return place, pace, change

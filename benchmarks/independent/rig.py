"""Test bench around the damper: coil, force channel and displacement channel."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit

from benchmarks.independent.plant import Array, Plant, integrate
from benchmarks.independent.strokes import Strokes

FieldMap = Callable[[Array], Array]
ForceMap = Callable[[Array, Strokes], Array]


@dataclass(frozen=True)
class Rig:
    """A damper with its coil and the channels of its load cell and its displacement transducer."""

    plant: Plant
    rise: float
    """Rate at which the field rises to the drive [1/s]."""
    fall: float
    """Rate at which it falls [1/s]."""
    dead_time: float = 0.0
    """[s]"""
    second_lag: float = 0.0
    """Time constant of a second lag [s]; 0 without it."""
    field_maps: tuple[FieldMap, ...] = ()
    """Changes of the field, one after the other."""
    force_maps: tuple[ForceMap, ...] = ()
    """Changes of the force [N] at the samples."""
    displacement_maps: tuple[Callable[[Array], Array], ...] = ()
    """Changes of the recorded displacement [m]."""

    def record(self, strokes: Strokes) -> tuple[Array, Array]:
        """Return displacement [m] and force [N] at the samples, without noise."""
        force = integrate(
            strokes.displacement, strokes.velocity, self._compute_field(strokes), strokes.step, strokes.stride,
            self.plant,
        )  # fmt: skip
        for change in self.force_maps:
            force = change(force, strokes)
        displacement = strokes.sample(strokes.displacement)
        for distort in self.displacement_maps:
            displacement = distort(displacement)
        return displacement, force

    def _compute_field(self, strokes: Strokes) -> Array:
        """Return the field every half step."""
        step = 0.5 * strokes.step
        drive = np.interp(strokes.time - self.dead_time, strokes.time, strokes.drive)
        field = _follow(drive, step, self.rise, self.fall)
        if self.second_lag > 0.0:
            field = _follow(field, step, 1.0 / self.second_lag, 1.0 / self.second_lag)
        for change in self.field_maps:
            field = change(field)
        return field


@njit(cache=True)
def _follow(target: Array, step: float, rise: float, fall: float) -> Array:
    """Return a first-order lag of a signal, with one rate upwards and one downwards [1/s]."""
    followed = np.empty_like(target)
    level = target[0]
    for k in range(len(target)):
        difference = target[k] - level
        level += difference * (1.0 - np.exp(-(rise if difference > 0.0 else fall) * step))
        followed[k] = level
    return followed


@njit(cache=True)
def follow_with_play(signal: Array, width: float) -> Array:
    """Return a signal behind a play of a half width."""
    followed = np.empty_like(signal)
    level = 0.0
    for k in range(len(signal)):
        level = min(max(level, signal[k] - width), signal[k] + width)
        followed[k] = level
    return followed

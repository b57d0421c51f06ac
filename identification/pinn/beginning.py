"""Where a training starts: coordinates by regression on a damper without memory, states read off the force.

Let the yield displacement go to zero, and the law forgets its past. While the dashpot c1 carries less than the
yield force, the inner point follows the stroke (force = c1 v); beyond that it slides, with
y' = (F + c0 v) / (c0 + c1). This broken line is fitted to all samples at once, robustly, for what it cannot follow
is the loop itself. The yield displacement is then the slip between a reversal and the place where the hysteretic
force has come down to zero. Nothing is simulated.
"""

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from identification.arrays import Array
from identification.damper.coordinates import Coordinates
from identification.pinn.batches import Learned
from identification.pinn.mesh import SlipVelocity, States
from identification.pinn.reversals import turning_points
from identification.problem import Problem

_SMOOTH = 0.008
"""[s] over which the recorded force is averaged."""
_ROWS = 3000
_DASHPOTS = (1.5, 4.0, 12.0)
"""[1] c1 to begin the regression with, over largest force and largest velocity."""
_STIFFNESS, _PRELOAD = 1e3, 50.0
"""[N/m] and [N] for one in the regression."""
_USUAL_LOOP = 5.0
"""[1] misfit over the noise from which on a sample belongs to the loop and weighs less."""
_NORMAL = 1.4826
"""[1] standard deviation of a normal distribution over its median absolute value."""
_RHO, _N, _ETA = 0.5, 1.7, 80.0
_ACCUMULATOR_SHARE = 0.3
"""[1] part of the stiffness that is taken for k1."""
_LEAST_YIELD, _MOST_YIELD = 1.5e-3, 5e-2
"""[1] of the half stroke."""
_FACTORS = (
    (1.0, 1.0, 1.0), (1.0, 5.0, 1.0), (1.0, 5.0, 3.0), (1.0, 1.0, 3.0), (1.0, 1.0, 0.4),
    (0.6, 1.0, 1.0), (1.6, 1.0, 1.0), (1.0, 1.0, 8.0), (1.0, 1.0, 0.15), (2.5, 1.0, 1.0),
)  # fmt: skip
"""[1] on c1, on its rise over the range of the drive (so much less at its lowest, so much more at its highest) and
on D_y: three for each start. A loop that hardly closes shows the regression little of c1."""


class Memoryless(NamedTuple):
    """A damper that forgets at once; pairs are values at the lowest and at the highest drive."""

    yield_force: tuple[float, float]
    """[N]"""
    c0: tuple[float, float]
    """[N s/m]"""
    c1: tuple[float, float]
    stiffness: float
    """[N/m]"""
    preload: float
    """[N]"""

    @staticmethod
    def of(q: Array) -> "Memoryless":
        """From the regression's numbers (8,)."""
        F, more, c0, c0_more, c1, c1_more = (float(value) for value in np.exp(q[:6]))
        return Memoryless(
            (F, more), (c0, c0_more), (c1, c1_more), float(q[6]) * _STIFFNESS, float(q[7]) * _PRELOAD
        )

    def inner_velocity(self, v: Array, place: Array) -> Array:
        """Y' [m/s] at velocities [m/s] and drives, 0 for the lowest and 1 for the highest."""
        F, c0, c1 = (low + (high - low) * place for low, high in (self.yield_force, self.c0, self.c1))
        return np.asarray(np.sign(v) * np.minimum(np.abs(v), (F + c0 * np.abs(v)) / (c0 + c1)))

    def force(self, x: Array, v: Array, place: Array) -> Array:
        """Force [N] at displacements [m], velocities [m/s] and drives."""
        c1 = self.c1[0] + (self.c1[1] - self.c1[0]) * place
        return np.asarray(c1 * self.inner_velocity(v, place) + self.stiffness * x - self.preload)


class Start(NamedTuple):
    """Where a training may start."""

    coordinates: Coordinates
    misfit: float
    """[N] that a damper without memory leaves on most samples."""
    effects: Array
    """(P,) search numbers of the effects beside the law."""


def starts(problem: Problem) -> Iterator[Start]:
    """Where to start from, the most promising first."""
    found = _memoryless(problem)
    slip = _yield_displacement(problem, found)
    misfit = _usual_misfit(problem, found)
    for number, (dashpot, rise, factor) in enumerate(_FACTORS):
        c1 = (found.c1[0] * dashpot / rise, found.c1[1] * dashpot * rise)
        coordinates = _coordinates(problem, found._replace(c1=c1), slip * factor)
        yield Start(coordinates, misfit, _effects(problem, number))


def _effects(problem: Problem, number: int) -> Array:
    """Search numbers (P,) of the effects, which have starts of their own; most begin with no size at all."""
    own = [e.to_search(e.form.starts[number % len(e.form.starts)]) for e in problem.effects]
    return np.concatenate([np.empty(0), *own])


def _usual_misfit(problem: Problem, found: Memoryless) -> float:
    """[N] as a standard deviation, told by the middle half of the samples: the others are the loop itself."""
    x, v, place, force = _rows(problem)
    return _NORMAL * float(np.median(np.abs(found.force(x, v, place) - force)))


def _memoryless(problem: Problem) -> Memoryless:
    x, v, place, force = _rows(problem)

    def misfit(q: Array) -> Array:
        return (Memoryless.of(q).force(x, v, place) - force) / problem.noise

    usual = float(np.median(np.abs(force))) + problem.noise
    viscous = 0.2 * usual / max(float(np.sqrt(np.mean(v**2))), 1e-9)
    fits = []
    for ratio in _DASHPOTS:
        c1 = ratio * float(np.abs(force).max() / np.abs(v).max())
        begin = np.log([0.3 * usual, usual, viscous, viscous, c1, c1])
        q = np.concatenate([begin, [1.0, 0.0]])
        fits.append(least_squares(misfit, q, loss="soft_l1", f_scale=_USUAL_LOOP, max_nfev=60))
    return Memoryless.of(min(fits, key=lambda fit: float(fit.cost)).x)


def _rows(problem: Problem) -> tuple[Array, Array, Array, Array]:
    """Displacement, velocity, place of the drive in its range and smoothed force of some fitted samples."""
    tables = []
    for p in problem.pieces:
        at = np.flatnonzero(p.train)
        at = at[:: max(1, len(at) * len(problem.pieces) // _ROWS)]
        s = p.stroke
        force = smoothed_force(p.force, s.rate)
        tables.append(np.stack([s.displacement[at], s.velocity[at], _place(problem, s.drive[at]), force[at]]))
    x, v, place, force = np.concatenate(tables, axis=1)
    return x, v, place, force


def _place(problem: Problem, drive: Array) -> Array:
    """Drives in their range: 0 for the lowest, 1 for the highest."""
    low, high = problem.space.lowest_drive, problem.space.highest_drive
    return np.asarray(np.clip((drive - low) / max(high - low, 1e-12), 0.0, 1.0))


def smoothed_force(force: Array, rate: float) -> Array:
    """A running mean (N,) of a recorded force [N]."""
    width = max(1, round(_SMOOTH * rate) | 1)
    return np.convolve(np.pad(force, width // 2, mode="edge"), np.ones(width) / width, "valid")


def _yield_displacement(problem: Problem, found: Memoryless) -> float:
    """[m] slip from a reversal until the hysteretic force is zero, as a rule."""
    slips = []
    for p in problem.pieces:
        s, place = p.stroke, _place(problem, p.stroke.drive)
        c0, c1 = (low + (high - low) * place for low, high in (found.c0, found.c1))
        force = smoothed_force(p.force, s.rate)
        y_rate = (force - found.stiffness * s.displacement + found.preload) / c1
        hysteretic = (c0 + c1) * y_rate - c0 * s.velocity
        slip = np.cumsum(s.velocity - y_rate) / s.rate
        slips += _until_zero(hysteretic, slip)
    stroke = 0.5 * max(float(np.ptp(p.stroke.displacement)) for p in problem.pieces)
    usual = float(np.quantile(slips, 0.75)) if slips else 0.0
    return float(np.clip(usual, _LEAST_YIELD * stroke, _MOST_YIELD * stroke))


def _until_zero(hysteretic: Array, slip: Array) -> list[float]:
    """[m] slip since the last extreme wherever the hysteretic force changes its sign."""
    found, last = [], 0
    for k in np.flatnonzero(np.diff(hysteretic > 0)):
        since = slip[last : k + 1] * np.sign(hysteretic[k])
        found.append(float(since.max() - since[-1]))
        last = int(k)
    return found


def _coordinates(problem: Problem, found: Memoryless, slip: float) -> Coordinates:
    low, high = problem.space.lowest_drive, problem.space.highest_drive

    def line(pair: tuple[float, float]) -> tuple[float, float]:
        slope = 0.0 if problem.space.one_drive else (pair[1] - pair[0]) / (high - low)
        return pair[0] - slope * low, slope

    F, c0, c1 = (line(pair) for pair in (found.yield_force, found.c0, found.c1))
    k1 = _ACCUMULATOR_SHARE * found.stiffness
    return Coordinates(
        F_a=F[0], F_b=F[1], D_y=slip, rho=_RHO, n=_N, eta=_ETA,
        c0_a=c0[0], c0_b=c0[1], c1_a=c1[0], c1_b=c1[1],
        k0=found.stiffness - k1, k1=k1, f0=found.preload,
    )  # fmt: skip


class FirstStates:
    """States of one piece as its recorded force shows them, for a damper with these coordinates.

    Args:
        source: the piece.
        c: of the damper.
        beside: force [N] (N,) that effects add.
    """

    def __init__(self, source: Learned, c: Coordinates, beside: Array | float = 0.0) -> None:
        piece, inputs = source.piece, source.inputs
        force = smoothed_force(piece.force - beside, piece.stroke.rate)
        self.time: Array = np.asarray(np.arange(len(force)) * inputs.h - piece.force_delay)
        x, v = inputs.motion(self.time)
        u = inputs.field(self.time, c.eta, piece.drive_delay).u
        self._y_rate = (force - c.k1 * x + c.f0) / (c.c1_a + c.c1_b * u)
        self._slip_rate = v - self._y_rate
        y = np.cumsum(self._y_rate) * inputs.h
        line = np.column_stack([np.ones(len(y)), self.time])
        self._y = y - line @ np.linalg.lstsq(line, y, rcond=None)[0] + float(np.mean(x))
        self._z = self._saturating(c.D_y, inputs.h)

    def _saturating(self, yield_displacement: float, h: float) -> Array:
        """From one saturation towards the other with the slip since each reversal."""
        slip = np.cumsum(self._slip_rate) * h
        turns = [0, *turning_points(slip, 0.5 * yield_displacement), len(slip) - 1]
        z = np.zeros(len(slip))
        for a, b in itertools.pairwise(turns):
            travelled = np.cumsum(np.abs(self._slip_rate[a : b + 1])) * h
            z[a : b + 1] = np.sign(slip[b] - slip[a]) * (1.0 - 2.0 * np.exp(-travelled / yield_displacement))
        return z

    def slip_velocity(self) -> SlipVelocity:
        """X' - y' [m/s] at any times [s]."""
        return lambda time: np.interp(time, self.time, self._slip_rate)

    def at(self, time: Array) -> States:
        """States at times [s]."""
        return States(*(np.interp(time, self.time, values) for values in (self._z, self._y, self._y_rate)))

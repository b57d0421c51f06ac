"""Start of a training: coordinates by regression on a memoryless damper, states estimated from the recorded force.

As the yield displacement goes to zero, the law loses its memory. While the dashpot c1 carries less than the yield
force, the inner point follows the stroke (force = c1 v). Above it the inner point slides with y' = (F + c0 v) /
(c0 + c1). This piecewise linear law is fitted to all samples at once. The fit is robust, because the hysteresis
loop itself is the part that it cannot follow. The yield displacement is then the slip between a reversal and the
zero of the hysteretic force. Nothing is simulated.
"""

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from identification.arrays import Array
from identification.damper import Coordinates
from identification.fitting import ACCUMULATOR_SHARE, START_FIELD_RATE, START_N, START_RHO, Problem
from identification.pinn.common.reversals import find_turning_points
from identification.pinn.common.states import SlipVelocity, States
from identification.pinn.common.training_pieces import TrainingPiece

_SMOOTHING_TIME = 0.008
"""Window of the running mean over the recorded force [s]."""
_MAX_SAMPLES = 3000
"""Largest number of samples in the regression, of all pieces together."""
_C1_STARTS = (1.5, 4.0, 12.0)
"""Starts of c1 in the regression, over the ratio of largest force and largest velocity [1]."""
_STIFFNESS_UNIT, _PRELOAD_UNIT = 1e3, 50.0
"""Stiffness [N/m] and preload [N] of a regression coefficient of one."""
_ROBUST_SCALE = 5.0
"""Threshold on the misfit over the noise [1]: above it, a sample belongs to the loop and loses weight."""
_MAD_TO_DEVIATION = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation [1]."""
_MIN_YIELD, _MAX_YIELD = 1.5e-3, 5e-2
"""Bounds of the yield displacement over half the stroke [1]."""
_START_FACTORS = (
    (1.0, 1.0, 1.0), (1.0, 5.0, 1.0), (1.0, 5.0, 3.0), (1.0, 1.0, 3.0), (1.0, 1.0, 0.4),
    (0.6, 1.0, 1.0), (1.6, 1.0, 1.0), (1.0, 1.0, 8.0), (1.0, 1.0, 0.15), (2.5, 1.0, 1.0),
)  # fmt: skip
"""Factors of each start [1]: on c1, on the increase of c1 over the drive's range, and on D_y.

The second factor divides c1 at the lowest drive and multiplies it at the highest. A loop that hardly closes
contains little information on c1, so the regression needs these alternatives.
"""


class MemorylessDamper(NamedTuple):
    """A damper with zero yield displacement; pairs are values at the lowest and at the highest drive."""

    yield_force: tuple[float, float]
    """Yield force [N]."""
    c0: tuple[float, float]
    """Damping of the sliding point [N s/m]."""
    c1: tuple[float, float]
    """Damping of the dashpot in series [N s/m]."""
    stiffness: float
    """Stiffness [N/m]."""
    preload: float
    """Preload [N]."""

    @staticmethod
    def make(q: Array) -> "MemorylessDamper":
        """Return the damper with regression coefficients (8,)."""
        F_low, F_high, c0_low, c0_high, c1_low, c1_high = (float(value) for value in np.exp(q[:6]))
        return MemorylessDamper(
            (F_low, F_high),
            (c0_low, c0_high),
            (c1_low, c1_high),
            float(q[6]) * _STIFFNESS_UNIT,
            float(q[7]) * _PRELOAD_UNIT,
        )

    def compute_inner_velocity(self, v: Array, drive: Array) -> Array:
        """Return y' [m/s] at velocities [m/s] and normalised drives."""
        F, c0, c1 = (_interpolate(pair, drive) for pair in (self.yield_force, self.c0, self.c1))
        return np.asarray(np.sign(v) * np.minimum(np.abs(v), (F + c0 * np.abs(v)) / (c0 + c1)))

    def compute_force(self, x: Array, v: Array, drive: Array) -> Array:
        """Return the force [N] at displacements [m], velocities [m/s] and normalised drives."""
        c1 = _interpolate(self.c1, drive)
        return np.asarray(c1 * self.compute_inner_velocity(v, drive) + self.stiffness * x - self.preload)


class TrainingStart(NamedTuple):
    """Coordinates and effect parameters at the start of a training."""

    coordinates: Coordinates
    misfit: float
    """Misfit of the memoryless damper [N]."""
    effects: Array
    """Search coordinates (P,) of the effect parameters."""


def generate_starts(problem: Problem) -> Iterator[TrainingStart]:
    """Yield starts of a training, the most promising first."""
    damper = _fit_memoryless(problem)
    slip = _estimate_yield_displacement(problem, damper)
    misfit = _estimate_misfit(problem, damper)
    for number, (dashpot, increase, factor) in enumerate(_START_FACTORS):
        c1 = (damper.c1[0] * dashpot / increase, damper.c1[1] * dashpot * increase)
        coordinates = _make_coordinates(problem, damper._replace(c1=c1), slip * factor)
        yield TrainingStart(coordinates, misfit, _choose_effect_starts(problem, number))


def _choose_effect_starts(problem: Problem, number: int) -> Array:
    """Return search coordinates (P,) of the effect parameters at their forms' own starts, mostly size zero."""
    starts = [e.to_search(e.starts[number % len(e.starts)]) for e in problem.effects]
    return np.concatenate([np.empty(0), *starts])


def _estimate_misfit(problem: Problem, damper: MemorylessDamper) -> float:
    """Return the misfit [N] as a standard deviation from the median, which excludes the loop's samples."""
    x, v, drive, force = _select_samples(problem)
    return _MAD_TO_DEVIATION * float(np.median(np.abs(damper.compute_force(x, v, drive) - force)))


def _fit_memoryless(problem: Problem) -> MemorylessDamper:
    x, v, drive, force = _select_samples(problem)

    def compute_misfit(q: Array) -> Array:
        return (MemorylessDamper.make(q).compute_force(x, v, drive) - force) / problem.noise

    typical_force = float(np.median(np.abs(force))) + problem.noise
    viscous = 0.2 * typical_force / max(float(np.sqrt(np.mean(v**2))), 1e-9)
    # Robust, because this damper has no loop, and samples after a reversal are far from it.
    fits = []
    for ratio in _C1_STARTS:
        c1 = ratio * float(np.abs(force).max() / np.abs(v).max())
        start = np.log([0.3 * typical_force, typical_force, viscous, viscous, c1, c1])
        q = np.concatenate([start, [1.0, 0.0]])
        fits.append(least_squares(compute_misfit, q, loss="soft_l1", f_scale=_ROBUST_SCALE, max_nfev=60))
    return MemorylessDamper.make(min(fits, key=lambda fit: float(fit.cost)).x)


def _select_samples(problem: Problem) -> tuple[Array, Array, Array, Array]:
    """Return displacement, velocity, normalised drive and smoothed force of some fitted samples."""
    tables = []
    for p in problem.pieces:
        samples = np.flatnonzero(p.train)
        samples = samples[:: max(1, len(samples) * len(problem.pieces) // _MAX_SAMPLES)]
        s = p.excitation
        drive, force = _normalise_drive(problem, s.drive[samples]), smooth_force(p.force, s.rate)
        tables.append(np.stack([s.displacement[samples], s.velocity[samples], drive, force[samples]]))
    x, v, drive, force = np.concatenate(tables, axis=1)
    return x, v, drive, force


def _normalise_drive(problem: Problem, drive: Array) -> Array:
    """Return drives over their range: 0 for the lowest, 1 for the highest."""
    low, high = problem.space.lowest_drive, problem.space.highest_drive
    return np.asarray(np.clip((drive - low) / max(high - low, 1e-12), 0.0, 1.0))


def _interpolate(pair: tuple[float, float], drive: Array) -> Array:
    """Return the value at normalised drives from those at the lowest and at the highest drive."""
    low, high = pair
    return low + (high - low) * drive


def smooth_force(force: Array, rate: float) -> Array:
    """Return the running mean (N,) of a recorded force [N]."""
    width = max(1, round(_SMOOTHING_TIME * rate) | 1)
    return np.convolve(np.pad(force, width // 2, mode="edge"), np.ones(width) / width, "valid")


def _estimate_yield_displacement(problem: Problem, damper: MemorylessDamper) -> float:
    """Return the slip [m] from a reversal to the zero of the hysteretic force (upper quartile)."""
    slips = []
    for p in problem.pieces:
        s, drive = p.excitation, _normalise_drive(problem, p.excitation.drive)
        c0, c1 = _interpolate(damper.c0, drive), _interpolate(damper.c1, drive)
        force = smooth_force(p.force, s.rate)
        y_rate = (force - damper.stiffness * s.displacement + damper.preload) / c1
        hysteretic = (c0 + c1) * y_rate - c0 * s.velocity
        slip = np.cumsum(s.velocity - y_rate) / s.rate
        slips += _measure_slips(hysteretic, slip)
    half_stroke = 0.5 * max(float(np.ptp(p.excitation.displacement)) for p in problem.pieces)
    quartile = float(np.quantile(slips, 0.75)) if slips else 0.0
    return float(np.clip(quartile, _MIN_YIELD * half_stroke, _MAX_YIELD * half_stroke))


def _measure_slips(hysteretic: Array, slip: Array) -> list[float]:
    """Return the slip [m] since the last extreme at each sign change of the hysteretic force."""
    slips, last = [], 0
    for k in np.flatnonzero(np.diff(hysteretic > 0)):
        since = slip[last : k + 1] * np.sign(hysteretic[k])
        slips.append(float(since.max() - since[-1]))
        last = int(k)
    return slips


def _make_coordinates(problem: Problem, damper: MemorylessDamper, slip: float) -> Coordinates:
    F, c0, c1 = (problem.space.fit_line(*pair) for pair in (damper.yield_force, damper.c0, damper.c1))
    k1 = ACCUMULATOR_SHARE * damper.stiffness
    return Coordinates(
        F_a=F[0], F_b=F[1], D_y=slip, rho=START_RHO, n=START_N, eta=START_FIELD_RATE * problem.space.scales.rate,
        c0_a=c0[0], c0_b=c0[1], c1_a=c1[0], c1_b=c1[1],
        k0=damper.stiffness - k1, k1=k1, f0=damper.preload,
    )  # fmt: skip


class InitialStates:
    """Initial states of one piece, estimated from its recorded force for a damper with given coordinates.

    Args:
        source: the piece.
        c: coordinates of the damper.
        parallel_force: force [N] (N,) that effects add.
    """

    def __init__(self, source: TrainingPiece, c: Coordinates, parallel_force: Array | float = 0.0) -> None:
        piece, inputs = source.piece, source.inputs
        force = smooth_force(piece.force - parallel_force, piece.excitation.rate)
        self.time = source.sample_times
        x, v = inputs.evaluate_motion(self.time)
        u = inputs.evaluate_field(self.time, c.eta, piece.drive_delay).u
        self._y_rate = (force - c.k1 * x + c.f0) / (c.c1_a + c.c1_b * u)
        self._slip_rate = v - self._y_rate
        y = np.cumsum(self._y_rate) * inputs.h
        line = np.column_stack([np.ones(len(y)), self.time])
        self._y = y - line @ np.linalg.lstsq(line, y, rcond=None)[0] + float(np.mean(x))
        self._z = self._estimate_hysteresis(c.D_y, inputs.h)

    def _estimate_hysteresis(self, yield_displacement: float, h: float) -> Array:
        """Return z (N,): an exponential approach to saturation with the slip since each reversal."""
        slip = np.cumsum(self._slip_rate) * h
        turns = [0, *find_turning_points(slip, 0.5 * yield_displacement), len(slip) - 1]
        z = np.zeros(len(slip))
        for a, b in itertools.pairwise(turns):
            travelled = np.cumsum(np.abs(self._slip_rate[a : b + 1])) * h
            z[a : b + 1] = np.sign(slip[b] - slip[a]) * (1.0 - 2.0 * np.exp(-travelled / yield_displacement))
        return z

    def make_slip_velocity(self) -> SlipVelocity:
        """Return the slip velocity x' - y' [m/s] as a function of times [s]."""
        return lambda time: np.interp(time, self.time, self._slip_rate)

    def evaluate(self, time: Array) -> States:
        """Return the states at times [s]."""
        return States(*(np.interp(time, self.time, values) for values in (self._z, self._y, self._y_rate)))

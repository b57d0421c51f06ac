"""Starting points of a fit, from the recording alone.

Away from reversals the hysteretic variable is saturated and the inner displacement barely moves. The force is then
linear: (F_a + F_b u) sgn v + (c0_a + c0_b u) v + (k0 + k1) x - f0. One regression gives these coefficients, and
the yield displacement is tried at a few fractions of the stroke.

In a damper that hardly yields, most of that viscous force is due to c1. Low-slip starts distribute the same peak
force accordingly, and are tried if the first starts fail.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from identification.arrays import Array
from identification.damper import Coordinates
from identification.fitting.piece import Piece
from identification.fitting.problem import Problem
from identification.fitting.unknown_layout import COORDINATE_COUNT

_SLIDING_FRACTION = 0.25
"""Threshold on velocity over a piece's peak velocity: above it, the hysteretic variable is saturated."""
_MAX_ROWS = 20_000
_YIELD_FRACTIONS = (0.002, 0.008, 0.04)
START_RHO, START_N, START_ETA = 0.5, 1.7, 80.0
"""Starting values of rho [1], n [1] and eta [1/s], on which no regression depends."""
_DASHPOT_RATIO = 12.0
"""Ratio of c1 to c0. Origin: order of magnitude in published dampers."""
_LOW_SLIP_YIELD, _LOW_SLIP_VISCOUS, _LOW_SLIP_DASHPOT = 0.8, 0.2, 1.2
"""Yield force, and forces of c0 and c1 at the peak velocity, over the peak force of a low-slip damper."""
ACCUMULATOR_SHARE = 0.3
"""Fraction of the sliding stiffness k0 + k1 that a start assigns to k1 [1]; the regression gives only the sum."""


def make_starting_points(problem: Problem) -> list[Array]:
    """Return starting points (U,), in the order of their cost."""
    return _sort_by_cost(problem, _make_starts(problem.pieces))


def make_low_slip_points(problem: Problem) -> list[Array]:
    """Return starting points (U,) for a damper that hardly yields, in the order of their cost."""
    return _sort_by_cost(problem, _make_low_slip_starts(problem.pieces))


def _sort_by_cost(problem: Problem, points: Iterator[Coordinates]) -> list[Array]:
    return sorted((problem.make_start(c) for c in points), key=lambda unknowns: _compute_cost(problem, unknowns))


def draw_random_start(problem: Problem, unknowns: Array, factor: float, seed: int) -> Array:
    """Return a start with every search coordinate moved at random by up to the logarithm of a factor."""
    random = np.random.default_rng(seed)
    low, high = problem.get_bounds()
    start = unknowns.copy()
    start[problem.layout.coordinates] += random.uniform(-1.0, 1.0, COORDINATE_COUNT) * np.log(factor)
    return np.clip(start, low, high)


def estimate_sliding_damping(pieces: Sequence[Piece]) -> float:
    """Return an estimate of c0 + c1 [N s/m] at zero drive, from the regression."""
    return (1.0 + _DASHPOT_RATIO) * max(float(_regress_force(pieces)[2]), 1.0)


def _make_starts(pieces: Sequence[Piece]) -> Iterator[Coordinates]:
    F_a, F_b, c0_a, c0_b, stiffness, offset = _regress_force(pieces)
    stroke = max(float(np.ptp(p.excitation.displacement)) for p in pieces) / 2.0
    for fraction in _YIELD_FRACTIONS:
        yield Coordinates(
            F_a=F_a,
            F_b=F_b,
            D_y=fraction * stroke,
            rho=START_RHO,
            n=START_N,
            eta=START_ETA,
            c0_a=c0_a,
            c0_b=c0_b,
            c1_a=_DASHPOT_RATIO * c0_a,
            c1_b=_DASHPOT_RATIO * c0_b,
            k0=(1 - ACCUMULATOR_SHARE) * stiffness,
            k1=ACCUMULATOR_SHARE * stiffness,
            f0=-offset,
        )


def _make_low_slip_starts(pieces: Sequence[Piece]) -> Iterator[Coordinates]:
    """Yield starts with the same peak forces in which the dashpot c1 carries most of the motion."""
    v = max(float(np.abs(p.excitation.velocity).max()) for p in pieces)
    for c in _make_starts(pieces):
        a, b = c.F_a + c.c0_a * v, c.F_b + c.c0_b * v
        yield c._replace(
            F_a=_LOW_SLIP_YIELD * a, F_b=_LOW_SLIP_YIELD * b,
            c0_a=_LOW_SLIP_VISCOUS * a / v, c0_b=_LOW_SLIP_VISCOUS * b / v,
            c1_a=_LOW_SLIP_DASHPOT * a / v, c1_b=_LOW_SLIP_DASHPOT * b / v,
        )  # fmt: skip


def _regress_force(pieces: Sequence[Piece]) -> Array:
    """Return F_a, F_b, c0_a, c0_b, k0 + k1 and the force offset, (6,)."""
    rows, forces = [], []
    for p in pieces:
        v, u = p.excitation.velocity, p.excitation.sampled_drive
        fast = np.flatnonzero((np.abs(v) > _SLIDING_FRACTION * np.abs(v).max()) & (p.train > 0))
        # Six coefficients need no more rows than these.
        fast = fast[:: max(1, len(fast) * len(pieces) // _MAX_ROWS)]
        v, u, sign = v[fast], u[fast], np.sign(v[fast])
        rows.append(
            np.column_stack([sign, u * sign, v, u * v, p.excitation.displacement[fast], np.ones(len(fast))])
        )
        forces.append(p.force[fast])
    table = np.vstack(rows)
    # Scaled columns give rcond the same meaning for metres and for volts. With one drive two pairs of columns are
    # collinear, and the solution of smallest norm is used.
    size = np.maximum(np.sqrt((table**2).mean(axis=0)), 1e-12)
    coefficients: Array = np.linalg.lstsq(table / size, np.concatenate(forces), rcond=1e-8)[0] / size
    return coefficients


def _compute_cost(problem: Problem, unknowns: Array) -> float:
    """Return the sum of squared force errors [N²] over the fitted samples; infinite if unstable."""
    forces = problem.simulate(unknowns)
    errors = [((f - p.force) ** 2 * p.train).sum() for f, p in zip(forces, problem.pieces, strict=True)]
    total = float(np.sum(errors))
    return total if np.isfinite(total) else float("inf")

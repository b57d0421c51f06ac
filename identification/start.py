"""Where the fit starts, from the recording alone.

Away from reversals the hysteretic variable is saturated and the inner displacement barely moves, so the force is
linear in what remains: (F_a + F_b u) sgn v + (c0_a + c0_b u) v + (k0 + k1) x - f0. One linear regression gives
these; the yield displacement is tried at a few fractions of the stroke. Of a damper that hardly breaks through,
most of what this calls viscous is c1: where the first starts fail, the same largest forces are shared out so.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from identification.arrays import Array
from identification.damper.coordinates import Coordinates
from identification.piece import Piece
from identification.problem import Problem

_FAST = 0.25
"""[1] fraction of a piece's peak velocity above which the hysteretic variable counts as saturated."""
_ROWS = 20_000
_YIELD_FRACTIONS = (0.002, 0.008, 0.04)
_SHAPE, _SHARPNESS, _ETA = 0.5, 1.7, 80.0
_DASHPOT_RATIO = 12.0
"""[1] c1 over c0, of the order found in published dampers."""
_HELD_YIELD, _HELD_VISCOUS, _HELD_DASHPOT = 0.8, 0.2, 1.2
"""[1] yield force, c0 and c1 at the largest velocity, over the largest force: of a damper that hardly breaks
through."""
_ACCUMULATOR_SHARE = 0.3
"""[1] part of the sliding stiffness that is taken for k1."""


def starting_points(problem: Problem) -> list[Array]:
    """Unknowns (U,) to start from, the most promising first."""
    return _sorted(problem, _coordinates(problem.pieces))


def further_points(problem: Problem) -> list[Array]:
    """The same for a damper that hardly breaks through."""
    return _sorted(problem, _hardly_yielding(problem.pieces))


def _sorted(problem: Problem, points: Iterator[Coordinates]) -> list[Array]:
    return sorted((problem.start(c) for c in points), key=lambda unknowns: _plain_cost(problem, unknowns))


def scattered(problem: Problem, unknowns: Array, factor: float, seed: int) -> Array:
    """A start with every coordinate moved at random by up to ``factor`` [1], for another try."""
    random = np.random.default_rng(seed)
    low, high = problem.bounds()
    moved = unknowns.copy()
    moved[:13] += random.uniform(-1.0, 1.0, 13) * np.log(factor)
    return np.clip(moved, low, high)


def sliding_damping(pieces: Sequence[Piece]) -> float:
    """Estimate of c0 + c1 [N s/m] at zero drive, from the regression."""
    return (1.0 + _DASHPOT_RATIO) * max(float(_regression(pieces)[2]), 1.0)


def _coordinates(pieces: Sequence[Piece]) -> Iterator[Coordinates]:
    F_a, F_b, c0_a, c0_b, stiffness, offset = _regression(pieces)
    stroke = max(float(np.ptp(p.stroke.displacement)) for p in pieces) / 2.0
    for fraction in _YIELD_FRACTIONS:
        yield Coordinates(
            F_a=F_a,
            F_b=F_b,
            D_y=fraction * stroke,
            rho=_SHAPE,
            n=_SHARPNESS,
            eta=_ETA,
            c0_a=c0_a,
            c0_b=c0_b,
            c1_a=_DASHPOT_RATIO * c0_a,
            c1_b=_DASHPOT_RATIO * c0_b,
            k0=(1 - _ACCUMULATOR_SHARE) * stiffness,
            k1=_ACCUMULATOR_SHARE * stiffness,
            f0=-offset,
        )


def _hardly_yielding(pieces: Sequence[Piece]) -> Iterator[Coordinates]:
    """The same largest forces, as a damper makes them whose dashpot c1 carries most of the motion."""
    v = max(float(np.abs(p.stroke.velocity).max()) for p in pieces)
    for c in _coordinates(pieces):
        a, b = c.F_a + c.c0_a * v, c.F_b + c.c0_b * v
        yield c._replace(
            F_a=_HELD_YIELD * a, F_b=_HELD_YIELD * b,
            c0_a=_HELD_VISCOUS * a / v, c0_b=_HELD_VISCOUS * b / v,
            c1_a=_HELD_DASHPOT * a / v, c1_b=_HELD_DASHPOT * b / v,
        )  # fmt: skip


def _regression(pieces: Sequence[Piece]) -> Array:
    """F_a, F_b, c0_a, c0_b, k0 + k1 and the force offset, (6,)."""
    rows, forces = [], []
    for p in pieces:
        v, u = p.stroke.velocity, p.stroke.drive_seen
        fast = np.flatnonzero((np.abs(v) > _FAST * np.abs(v).max()) & (p.train > 0))
        fast = fast[:: max(1, len(fast) * len(pieces) // _ROWS)]
        v, u, sign = v[fast], u[fast], np.sign(v[fast])
        rows.append(np.column_stack([sign, u * sign, v, u * v, p.stroke.displacement[fast], np.ones(len(fast))]))
        forces.append(p.force[fast])
    table = np.vstack(rows)
    # Columns of one size, so that the limit below means the same for metres and for volts. With one drive two
    # pairs of columns are alike, and the smallest answer shares between them.
    size = np.maximum(np.sqrt((table**2).mean(axis=0)), 1e-12)
    found: Array = np.linalg.lstsq(table / size, np.concatenate(forces), rcond=1e-8)[0] / size
    return found


def _plain_cost(problem: Problem, unknowns: Array) -> float:
    """Sum of squared force errors [N^2] over the fitted samples."""
    forces = problem.simulate(unknowns)
    errors = [((f - p.force) ** 2 * p.train).sum() for f, p in zip(forces, problem.pieces, strict=True)]
    total = float(np.sum(errors))
    return total if np.isfinite(total) else float("inf")

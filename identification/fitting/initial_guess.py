"""Starting points of a fit, from the recording alone.

Away from reversals the hysteretic variable is saturated and the inner displacement barely moves. The force is then
linear: (F_a + F_b u) sgn v + (c0_a + c0_b u) v + (k0 + k1) x - f0. One regression gives these coefficients.

In a damper that hardly yields, most of that viscous force is due to c1, and the regression fails. The second start
distributes the same peak force accordingly. A damper may also slide at the lowest drive and hardly yield at the
highest one, which is the third start.
"""

from collections.abc import Sequence

import numpy as np

from identification.arrays import Array, BoolArray
from identification.damper import Coordinates
from identification.fitting.piece import Piece
from identification.fitting.problem import Problem
from identification.fitting.recording_scales import RecordingScales
from identification.fitting.search_space import SearchSpace
from identification.fitting.unknown_layout import COORDINATE_COUNT

_SLIDING_FRACTION = 0.3
"""Threshold on velocity over a piece's peak velocity: above it, the hysteretic variable is saturated."""
_PEAK_QUANTILE = 0.99
"""Quantile of the speed that counts as a piece's peak velocity [1]."""
_SETTLING = 0.3
"""Time in which the field follows a change of the drive, in units of the recording's time."""
_DRIVE_CHANGE = 0.1
"""Change of the drive over its range above which a sample is not settled [1]."""
_MAX_ROWS, _MIN_ROWS = 20_000, 60
"""Largest number of samples in the regression, and smallest number of settled ones."""
_YIELD_DISPLACEMENT, _LOW_SLIP_YIELD_DISPLACEMENT = 0.008, 0.02
"""Yield displacement of a damper that slides and of one that hardly yields, in units of the length."""
START_RHO, START_N, START_FIELD_RATE = 0.5, 1.7, 20.0
"""Starting values of rho [1], n [1] and eta [units of the rate], on which no regression depends."""
_DASHPOT_RATIO, _LOW_SLIP_DASHPOT_RATIO = 12.0, 6.0
"""Ratio of c1 to c0 in both. Origin: order of magnitude in published dampers."""
_LOW_SLIP_YIELD, _LOW_SLIP_VISCOUS = 0.8, 0.2
"""Yield force, and force of c0 at the peak velocity, over the peak force of a low-slip damper."""
_LEAST_SHARE = 0.02
"""Smallest yield force, and force of c0 at the peak velocity, over the peak force [1]."""
ACCUMULATOR_SHARE = 0.3
"""Fraction of the sliding stiffness k0 + k1 that a start assigns to k1 [1]; the regression gives only the sum."""


def make_starting_points(problem: Problem) -> list[Array]:
    """Return the starting points (U,): a damper that slides, one that hardly yields, and one that does both."""
    coefficients = _regress_force(problem.pieces, problem.space.scales)
    starts = _make_sliding_start, _make_low_slip_start, _make_mixed_start
    return [problem.make_start(make_start(coefficients, problem.space)) for make_start in starts]


def draw_random_start(problem: Problem, unknowns: Array, factor: float, seed: int) -> Array:
    """Return a start with every search coordinate moved at random.

    Logarithmic ones move by up to the logarithm of the factor, the others by up to a tenth of it.
    """
    random = np.random.default_rng(seed)
    low, high = problem.get_bounds()
    start = unknowns.copy()
    size = np.log(factor) * np.where(problem.space.log_mask, 1.0, 0.1)
    start[problem.layout.coordinates] += random.uniform(-1.0, 1.0, COORDINATE_COUNT) * size
    return np.clip(start, low, high)


def estimate_least_damping(pieces: Sequence[Piece], scales: RecordingScales) -> float:
    """Return the least c0 + c1 [N s/m] at zero drive that the regression allows.

    Its damping is c0 in a damper that slides, and c1 in a damper that hardly yields.
    """
    return max(float(_regress_force(pieces, scales)[2]), _LEAST_SHARE * scales.damping)


def _make_sliding_start(coefficients: Array, space: SearchSpace) -> Coordinates:
    yields, c0 = _distribute_sliding(coefficients, space)
    return _make_coordinates(coefficients, space, _YIELD_DISPLACEMENT, yields, c0, _DASHPOT_RATIO)


def _make_mixed_start(coefficients: Array, space: SearchSpace) -> Coordinates:
    """Return a start that slides at the lowest drive and hardly yields at the highest."""
    sliding, low_slip = _distribute_sliding(coefficients, space), _distribute_low_slip(coefficients, space)
    yields, c0 = (np.array([s[0], h[1]]) for s, h in zip(sliding, low_slip, strict=True))
    return _make_coordinates(coefficients, space, _YIELD_DISPLACEMENT, yields, c0, _LOW_SLIP_DASHPOT_RATIO)


def _distribute_sliding(coefficients: Array, space: SearchSpace) -> tuple[Array, Array]:
    """Return the regression's yield forces [N] and c0 [N s/m] at lowest and highest drive, (2,) each."""
    F_a, F_b, c0_a, c0_b, _, _ = coefficients
    drives = np.array([space.lowest_drive, space.highest_drive])
    least = _LEAST_SHARE * _compute_peak_forces(coefficients, space)
    return np.maximum(F_a + F_b * drives, least), np.maximum(c0_a + c0_b * drives, least / space.scales.velocity)


def _distribute_low_slip(coefficients: Array, space: SearchSpace) -> tuple[Array, Array]:
    """Return the yield forces [N] and c0 [N s/m] of a damper that hardly yields with the same peak forces."""
    peaks = _compute_peak_forces(coefficients, space)
    return _LOW_SLIP_YIELD * peaks, _LOW_SLIP_VISCOUS * peaks / space.scales.velocity


def _make_low_slip_start(coefficients: Array, space: SearchSpace) -> Coordinates:
    """Return a start with the same peak forces in which the dashpot c1 carries most of the motion."""
    yields, c0 = _distribute_low_slip(coefficients, space)
    return _make_coordinates(
        coefficients, space, _LOW_SLIP_YIELD_DISPLACEMENT, yields, c0, _LOW_SLIP_DASHPOT_RATIO
    )


def _compute_peak_forces(coefficients: Array, space: SearchSpace) -> Array:
    """Return the forces [N] at the peak velocity, at the lowest and at the highest drive, (2,)."""
    F_a, F_b, c0_a, c0_b, _, _ = coefficients
    drives, velocity = np.array([space.lowest_drive, space.highest_drive]), space.scales.velocity
    peaks = F_a + F_b * drives + (c0_a + c0_b * drives) * velocity
    return np.asarray(np.maximum(peaks, _LEAST_SHARE * space.scales.force))


def _make_coordinates(
    coefficients: Array, space: SearchSpace, slip: float, yields: Array, c0: Array, dashpot_ratio: float
) -> Coordinates:
    """Return coordinates from the yield forces [N] and c0 [N s/m] at both ends of the drive range, (2,) each."""
    F_a, F_b = space.fit_line(*yields)
    c0_a, c0_b = space.fit_line(*c0)
    stiffness, offset = coefficients[4:]
    return Coordinates(
        F_a=F_a, F_b=F_b, D_y=slip * space.scales.length,
        rho=START_RHO, n=START_N, eta=START_FIELD_RATE * space.scales.rate,
        c0_a=c0_a, c0_b=c0_b, c1_a=dashpot_ratio * c0_a, c1_b=dashpot_ratio * c0_b,
        k0=(1 - ACCUMULATOR_SHARE) * stiffness, k1=ACCUMULATOR_SHARE * stiffness, f0=-offset,
    )  # fmt: skip


def _regress_force(pieces: Sequence[Piece], scales: RecordingScales) -> Array:
    """Return F_a, F_b, c0_a, c0_b, k0 + k1 and the force offset, (6,)."""
    sliding = [_find_sliding_samples(p) for p in pieces]
    settled = [s & _find_settled_samples(p, scales) for s, p in zip(sliding, pieces, strict=True)]
    used = settled if sum(np.count_nonzero(s) for s in settled) >= _MIN_ROWS else sliding
    rows, forces = [], []
    for p, mask in zip(pieces, used, strict=True):
        fast = np.flatnonzero(mask)
        # Six coefficients need no more rows than these.
        fast = fast[:: max(1, len(fast) * len(pieces) // _MAX_ROWS)]
        v, u = p.excitation.velocity[fast], p.excitation.sampled_drive[fast]
        sign = np.sign(v)
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


def _find_sliding_samples(piece: Piece) -> BoolArray:
    speed = np.abs(piece.excitation.velocity)
    return np.asarray((speed > _SLIDING_FRACTION * np.quantile(speed, _PEAK_QUANTILE)) & (piece.train > 0))


def _find_settled_samples(piece: Piece, scales: RecordingScales) -> BoolArray:
    """Return where the field has followed the drive."""
    drive = piece.excitation.sampled_drive
    lag = min(round(_SETTLING / scales.rate * piece.excitation.rate), len(drive) - 1)
    before = np.concatenate([np.full(lag, drive[0]), drive[: len(drive) - lag]])
    return np.asarray(np.abs(drive - before) <= _DRIVE_CHANGE * np.ptp(drive))

"""Next stroke: the trial segment that best separates the sets of effects which the data leave open.

The segments are simulated with each rival model. The score is the difference of their forces that no refit could
remove, over the noise (T-optimal design, Atkinson and Fedorov 1975). It is linearised in the parameters of damper
and effects, each held by the information of the recording. Either rival may be the true one, and the other is
refitted. The smaller difference of both cases counts. Form errors mask a difference in the same way as noise.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from identification.arrays import Array
from identification.damper import Coordinates
from identification.documents import NextStroke
from identification.fitting import COORDINATE_COUNT, compute_rmse
from identification.gap.fits import JointFit
from identification.gap.outcome.trial_segments import StrokeLimits, generate_trial_segments
from identification.gap.selection import MAX_TIED_SETS, MIN_TIED_PROBABILITY, CandidatePool, Posterior
from identification.simulate import SENSITIVITY_COLUMNS, ActiveEffect, Excitation, SimulationModel, simulate

_SPEED_QUANTILE = 0.999
"""Quantile of the speed that counts as the largest recorded one."""
_LOWEST_FREQUENCY_LIMIT = 0.5
"""Smallest limit on the frequency of a proposed stroke [Hz]."""
_MIN_PAIR_WEIGHT = 1e-12
"""Smallest weight of a pair of rivals; it prevents a sum of zero."""


@dataclass(frozen=True)
class RivalModel:
    """One of the sets of effects that the data cannot separate, with its parameters."""

    names: tuple[str, ...]
    coordinates: Coordinates
    effects: tuple[ActiveEffect, ...]
    probability: float
    """Weight among the rivals [1]."""
    form_error: float
    """Part of the gap that remains because the forms are not exact [1]."""
    information: Array
    """(13 + P, 13 + P) information of the recording on coordinates and parameters of the effects [1/SI²]."""


@dataclass(frozen=True)
class ProposedSegment:
    """The chosen segment."""

    segment: dict[str, Any]
    separated_sets: list[list[str]]
    difference: float
    """Root mean square difference of the rivals' forces [N]."""
    detectability: float
    """Difference that no refit removes, over noise and form error, times the root of the number of samples [1]."""


def propose_next_stroke(pool: CandidatePool, posterior: Posterior) -> NextStroke | None:
    """Return the stroke that best separates the most probable sets; None where nothing is open."""
    tied = [(names, p) for names, p in posterior.rank_sets() if p > MIN_TIED_PROBABILITY][:MAX_TIED_SETS]
    rivals = [_make_rival_model(pool, names, p) for names, p in tied]
    chosen = find_best_segment(rivals, pool.baseline.fit.coordinates, _find_limits(pool), pool.floor)
    if chosen is None:
        return None
    return NextStroke(
        segment=chosen.segment,
        separates=chosen.separated_sets,
        expected_n=chosen.difference,
        detectability=chosen.detectability,
    )


def _make_rival_model(pool: CandidatePool, names: frozenset[str], probability: float) -> RivalModel:
    candidate = pool.candidates[names]
    form_error = max(pool.compute_excess(candidate), 0.0) / max(pool.baseline_excess, 1e-3)
    fit = candidate.fit
    return RivalModel(
        tuple(sorted(names)),
        fit.coordinates,
        fit.active_effects,
        probability,
        min(form_error, 1.0),
        compute_information(fit),
    )


def _find_limits(pool: CandidatePool) -> StrokeLimits:
    """Return the limits of motion and drive that the recording reached."""
    strokes = [p.excitation for p in pool.evaluation.pieces]
    low = min(float(s.displacement.min()) for s in strokes)
    high = max(float(s.displacement.max()) for s in strokes)
    space = pool.problems.full.space
    return StrokeLimits(
        amplitude=0.5 * (high - low),
        centre=0.5 * (high + low),
        velocity=max(float(np.quantile(np.abs(s.velocity), _SPEED_QUANTILE)) for s in strokes),
        frequency=max([c.frequency for c in pool.evaluation.cycles.conditions] + [_LOWEST_FREQUENCY_LIMIT]),
        drives=(space.lowest_drive, space.highest_drive),
    )


def find_best_segment(
    rivals: Sequence[RivalModel], law: Coordinates, limits: StrokeLimits, noise: float
) -> ProposedSegment | None:
    """Return the trial segment that separates the rivals best; None with fewer than two rivals.

    ``law`` is the damper without effects, ``noise`` that of the force [N].
    """
    best: ProposedSegment | None = None
    for segment, excitation in generate_trial_segments(limits) if len(rivals) > 1 else ():
        law_force = simulate(SimulationModel(law, y0=limits.centre), excitation).force
        forces = [_PredictedForce.make(r, excitation, limits.centre, law_force, noise) for r in rivals]
        pairs = [(a, b) for i, a in enumerate(forces) for b in forces[:i]]
        weights = np.array([a.rival.probability * b.rival.probability + _MIN_PAIR_WEIGHT for a, b in pairs])
        score = float(np.average([_compute_detectability(a, b, noise) for a, b in pairs], weights=weights))
        if np.isfinite(score) and (best is None or score > best.detectability):
            squares = [compute_rmse(a.force - b.force) ** 2 for a, b in pairs]
            difference = float(np.sqrt(np.average(squares, weights=weights)))
            best = ProposedSegment(segment, [list(r.names) for r in rivals], difference, score)
    return best


def compute_information(fit: JointFit) -> Array:
    """Return the information of the recording on coordinates and effects [1/SI²], (13 + P, 13 + P).

    Delays, y(0) and per-log parameters are eliminated.
    """
    problem, unknowns = fit.problem, fit.minimum.unknowns
    kept = np.zeros(len(unknowns), bool)
    kept[:COORDINATE_COUNT] = kept[problem.layout.effects] = True
    H = fit.minimum.evaluation.hessian
    cross = H[np.ix_(kept, ~kept)]
    information = H[np.ix_(kept, kept)] - cross @ np.linalg.pinv(H[np.ix_(~kept, ~kept)]) @ cross.T
    scaling = np.zeros(information.shape)
    law = slice(0, COORDINATE_COUNT)
    scaling[law, law] = np.linalg.pinv(problem.space.differentiate(unknowns[law]))
    effects = range(COORDINATE_COUNT, len(information))
    scaling[effects, effects] = 1.0 / problem.differentiate_effects(unknowns)
    return np.asarray(scaling.T @ information @ scaling)


@dataclass(frozen=True)
class _PredictedForce:
    """Force of a rival model on a trial segment."""

    rival: RivalModel
    force: Array
    """(N,) [N]"""
    sensitivities: Array
    """(N, 13 + P + 2) over coordinates, parameters of the effects, y(0) and the zero of the load cell."""
    total_error: float
    """Noise and form error [N]."""

    @staticmethod
    def make(
        rival: RivalModel, excitation: Excitation, centre: float, law_force: Array, noise: float
    ) -> "_PredictedForce":
        """Simulate a rival model; ``law_force`` is the force of the law alone [N], (N,)."""
        model = SimulationModel(rival.coordinates, y0=centre, effects=rival.effects)
        result = simulate(model, excitation, sensitivities=True)
        effects = range(len(SENSITIVITY_COLUMNS), result.sensitivities.shape[1])
        columns = [*range(COORDINATE_COUNT), *effects, SENSITIVITY_COLUMNS.index("y0")]
        sensitivities = np.column_stack([result.sensitivities[:, columns], np.ones(len(result.force))])
        form_error = math.sqrt(rival.form_error) * compute_rmse(result.force - law_force)
        return _PredictedForce(rival, result.force, sensitivities, math.hypot(noise, form_error))


def _compute_detectability(a: _PredictedForce, b: _PredictedForce, noise: float) -> float:
    """Return the difference of two rivals that no refit removes, over noise and form error [1]."""
    difference = (a.force - b.force) / noise
    # The rival that imitates the other better counts: a refit of it would hide the difference.
    irreducible = min(_compute_irreducible_norm(difference, p.sensitivities / noise, p.rival) for p in (a, b))
    return irreducible * noise / max(a.total_error, b.total_error)


def _compute_irreducible_norm(difference: Array, J: Array, refitted: RivalModel) -> float:
    """Return the norm [1] of the part of a difference (N,), over the noise, that a refit of one rival leaves."""
    normal, known = J.T @ J, len(refitted.information)
    normal[:known, :known] += refitted.information
    # A parameter without sensitivity on this segment is known from the recording alone: both set the scale.
    size = np.sqrt(np.diag(normal))
    size[size == 0.0] = 1.0
    right = (J.T @ difference) / size
    removed = float(right @ np.linalg.lstsq(normal / np.outer(size, size), right, rcond=1e-12)[0])
    return math.sqrt(max(float(difference @ difference) - removed, 0.0))

"""Remainder: part of the gap that the named effects leave, and the variables that it depends on."""

from collections.abc import Mapping

import numpy as np

from identification.arrays import Array
from identification.damper.effects import Stage
from identification.documents import Remainder
from identification.gap.data import NEAR_FLOOR_RATIO, Cycles, EvaluationData, Indices, Residual, map_gap
from identification.gap.discovery import locate_unlisted_cause
from identification.gap.fits import Candidate
from identification.gap.noise import FEATURE_VARIABLES, ResidualRegression
from identification.gap.selection import CandidatePool, compute_expected_gain

_MIN_VARIABLE_SHARE = 0.05
"""Smallest part of the remainder's variance that is lost without a variable for it to be listed."""
_MIN_STAGE_GAIN = 0.05
"""Smallest expected gain of an effect, relative to the remaining excess, that points to a stage."""
_LIKELY_STAGE = 0.5
"""Probability above which a stage is likely."""
_MIN_CYCLES = 2
"""Smallest number of cycles of one segment of which the repetition can be judged."""


def describe_remainder(
    pool: CandidatePool,
    named: Candidate,
    regression: ResidualRegression,
    floor: float,
    stages: Mapping[Stage, float] | None = None,
) -> Remainder | None:
    """Describe the residual of a set of effects on held-out strokes; None if it is at the noise floor.

    Args:
        pool: the fitted sets.
        named: the named set; the baseline if none is named.
        regression: regression on the residuals of this recording.
        floor: noise of the force [N].
        stages: probability of each stage for the remaining cause, where it is known.
    """
    if named.held_out_rmse < NEAR_FLOOR_RATIO * floor:
        return None
    evaluation, explained = pool.evaluation, regression.explain(named)
    strongest = sorted(FEATURE_VARIABLES, key=lambda v: -explained.losses[v])
    return Remainder(
        gap_n=float(np.sqrt(named.held_out_rmse**2 - floor**2)),
        explainable=explained.share,
        not_repeating=estimate_not_repeating(named.residual, evaluation, floor),
        stage=_find_stage(pool, named, stages or locate_unlisted_cause(pool, named)),
        map=map_gap(named.residual, evaluation.cycles, floor),
        variables=[v for v in strongest if explained.losses[v] > _MIN_VARIABLE_SHARE],
    )


def estimate_not_repeating(residual: Residual, evaluation: EvaluationData, floor: float) -> float | None:
    """Estimate the part of the gap's variance [1] that differs between the cycles of a segment.

    Each cycle is compared with the mean of its segment at the same phase. One cycle gives no answer.
    """
    cycles = evaluation.cycles
    deviation, gap, samples = 0.0, 0.0, 0
    for rows in _group_cycles(cycles, evaluation):
        table = np.stack([residual.values[r] for r in rows])
        count = len(table)
        # The mean contains each cycle itself, which takes away one of its degrees of freedom.
        deviation += float(np.sum((table - table.mean(axis=0)) ** 2)) * count / (count - 1)
        gap += float(np.sum(table**2))
        samples += table.size
    if not samples or gap <= samples * floor**2:
        return None
    share = (deviation - samples * floor**2) / (gap - samples * floor**2)
    return float(np.clip(share, 0.0, 1.0))


def _group_cycles(cycles: Cycles, evaluation: EvaluationData) -> list[list[Indices]]:
    """Return, for each segment with repeated cycles, the sample of each cycle that is nearest to each phase."""
    groups = []
    for segment in np.unique(cycles.segment):
        if not cycles.conditions[segment].frequency:
            continue
        members = [np.flatnonzero(cycles.cycle == c) for c in np.flatnonzero(cycles.segment == segment)]
        whole = [m for m in members if len(m) and evaluation.usable[m].all()]
        if len(whole) < _MIN_CYCLES:
            continue
        phases = np.arange(min(map(len, whole))) / min(map(len, whole))
        groups.append([m[_find_nearest(cycles.phase[m], phases)] for m in whole])
    return groups


def _find_nearest(phase: Array, wanted: Array) -> Indices:
    """Return the index of the sample nearest to each wanted phase [cycles]; phases are periodic."""
    order = np.argsort(phase)
    extended = np.concatenate([[phase[order[-1]] - 1.0], phase[order], [phase[order[0]] + 1.0]])
    rows = np.concatenate([[order[-1]], order, [order[0]]])
    after = np.clip(np.searchsorted(extended, wanted), 1, len(extended) - 1)
    before = after - 1
    nearer = np.where(wanted - extended[before] < extended[after] - wanted, before, after)
    return np.asarray(rows[nearer])


def _find_stage(pool: CandidatePool, named: Candidate, stages: Mapping[Stage, float]) -> Stage | None:
    """Return the likely stage of the remaining cause, else the stage of a known effect.

    A known effect counts where no stage is likely. It is the one with the largest expected gain.
    """
    likeliest = max(stages, key=stages.__getitem__)
    if stages[likeliest] > _LIKELY_STAGE:
        return likeliest
    best = max(pool.screen(named, named.names), key=compute_expected_gain, default=None)
    if best is None or compute_expected_gain(best) < _MIN_STAGE_GAIN:
        return None
    return best.effect_model.effect.stage

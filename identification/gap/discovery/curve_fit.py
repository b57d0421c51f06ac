"""Fit of curves together with the law and the effects that are already named."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.fitting import EffectModel, OptimiserSettings, Problem, fit_output_error, minimise
from identification.gap.discovery.curve_basis import LinearGrowth
from identification.gap.discovery.curve_effects import CurveEffect, list_curve_effects
from identification.gap.discovery.curve_evidence import (
    CurveEvidence,
    compute_curve_evidence,
    estimate_correlation_length,
)
from identification.gap.fits import Candidate, JointFit, insert_effect_unknowns
from identification.gap.selection import CandidatePool, compute_evidence
from identification.progress import ignore_progress
from identification.threads import use_one_thread

_FITTED_CURVES = 5
"""Number of curves with the largest linear evidence that are fitted."""
_ITERATIONS = 25
"""Largest number of iterations of a fit."""
_PRIOR_UPDATES = 2
"""Number of times that the prior of a curve is estimated again after its fit."""
_SMALLEST_DEVIATION = 1e-8
"""Smallest prior deviation [1]: a curve of zero keeps one."""
_FRESH_FIT = OptimiserSettings(iterations=_ITERATIONS, restarts=0, holds_shape=True)
"""Fit from the regression."""
_GROWTH_DEVIATION = 1.0
"""Prior deviation of the growth with the drive, over the inverse of the highest drive [1]."""


class ScreenedCurve(NamedTuple):
    """A curve with its linear evidence."""

    curve: CurveEffect
    evidence: CurveEvidence


@dataclass(frozen=True)
class FittedCurve:
    """A curve fitted with the law and other effects."""

    curve: CurveEffect
    candidate: Candidate
    parent: Candidate
    """The set without the curve."""
    log_odds: float
    """Block evidence for the curve over the set without it, on all strokes."""
    held_out_log_odds: float
    """The same on held-out strokes."""

    @property
    def values(self) -> tuple[float, ...]:
        """Coefficients of the curve."""
        return self.candidate.fit.active_effects[-1].values

    @property
    def covariance(self) -> Array:
        """(P, P) covariance of these coefficients."""
        columns = list(self.candidate.fit.problem.iterate_effects())[-1][1]
        return np.asarray(self.candidate.fit.covariance.unknowns[columns, columns])


def screen_curves(pool: CandidatePool, parent: Candidate) -> list[ScreenedCurve]:
    """Return all curves that the recording can show, with their linear evidence, the largest first."""
    problem = pool.decimated_problem.replace_effects(parent.fit.effects)
    unknowns = parent.fit.minimum.unknowns
    simulated = problem.simulate(unknowns)
    residuals = [p.force - f for p, f in zip(problem.pieces, simulated, strict=True)]
    correlated = estimate_correlation_length(residuals)
    curves = list_curve_effects(problem, simulated)
    screened = [ScreenedCurve(c, _screen_curve(problem, unknowns, c, correlated)) for c in curves]
    return sorted(screened, key=lambda s: -s.evidence.log_odds)


def _screen_curve(problem: Problem, unknowns: Array, curve: CurveEffect, correlated: float) -> CurveEvidence:
    joint = problem.replace_effects((*problem.effects, curve.linear_model))
    count, first = len(curve.linear_model.quantities), problem.layout.per_log.start
    start = insert_effect_unknowns(problem, unknowns, np.zeros(count))
    return compute_curve_evidence(joint, joint.evaluate(start), slice(first, first + count), correlated)


def fit_best_curves(
    pool: CandidatePool, parent: Candidate, screened: Sequence[ScreenedCurve]
) -> list[FittedCurve]:
    """Fit the curves with the largest linear evidence, and return the best on held-out strokes first."""
    fitted = [fit_curve(pool, parent, s) for s in screened[:_FITTED_CURVES]]
    return sorted(fitted, key=lambda f: -f.log_odds)


def fit_curve(pool: CandidatePool, parent: Candidate, screened: ScreenedCurve) -> FittedCurve:
    """Fit a curve with the law and the effects of a set.

    The fit starts at the end of the linear model, and at the regression: without the curve, the law may have moved
    to values that hide it.
    """
    curve, evidence = screened
    model = _give_prior(curve, evidence.deviation)
    parent_problem = pool.decimated_problem.replace_effects(parent.fit.effects)
    problem = parent_problem.replace_effects((*parent.fit.effects, model))
    start = insert_effect_unknowns(parent_problem, parent.fit.minimum.unknowns, np.zeros(len(model.quantities)))
    target = _find_linear_solution(parent_problem, parent.fit.minimum.unknowns, screened)
    regression = replace_law(problem, start, pool.regression_start)
    with use_one_thread():
        minima = [
            minimise(problem, _search_line(problem, start, target), _ITERATIONS, ignore_progress),
            fit_output_error(problem, _FRESH_FIT, start=regression),
        ]
        fit = JointFit(problem, min(minima, key=lambda m: m.evaluation.cost))
        for _ in range(_PRIOR_UPDATES):
            fit = _update_prior(fit, curve)
    return judge_curve(pool, parent, curve, pool.evaluate(fit))


def _update_prior(fit: JointFit, curve: CurveEffect) -> JointFit:
    """Continue a fit with the prior deviation that its coefficients suggest (MacKay 1992, eq. 2.17).

    The linear model takes all that it leaves for noise, so its prior is too narrow for a large curve.
    """
    problem, unknowns = fit.problem, fit.minimum.unknowns
    columns = list(problem.iterate_effects())[-1][1]
    inner = slice(columns.start, columns.start + curve.function.basis.size)
    simulated = problem.simulate(unknowns)
    residuals = [p.train * (p.force - f) for p, f in zip(problem.pieces, simulated, strict=True)]
    variance = max(fit.ratio**2, 1.0) * estimate_correlation_length(residuals)
    # The curvature of a coefficient of which nothing is known is that of its prior alone.
    known = (
        1.0
        - np.diag(np.linalg.pinv(fit.minimum.evaluation.hessian))[inner]
        / problem.effects[-1].prior_deviations[0] ** 2
    )
    determined = max(float(np.sum(np.clip(known, 0.0, 1.0))), 1.0)
    deviation = float(np.sqrt(np.sum(unknowns[inner] ** 2) / determined / variance))
    model = _give_prior(curve, max(deviation, _SMALLEST_DEVIATION))
    again = problem.replace_effects((*problem.effects[:-1], model))
    return JointFit(again, minimise(again, unknowns, _ITERATIONS, ignore_progress))


def replace_law(problem: Problem, unknowns: Array, law: Array) -> Array:
    """Return unknowns (U,) with coordinates, delays and y(0) of a law alone, and the effects' values kept."""
    moved = unknowns.copy()
    first = problem.layout.effects.start
    moved[:first] = law[:first]
    return moved


def judge_curve(pool: CandidatePool, parent: Candidate, curve: CurveEffect, candidate: Candidate) -> FittedCurve:
    """Return a fitted curve with its block evidence over the set without it."""
    before, after, held_out = parent.residual, candidate.residual, pool.evaluation.held_out_samples
    unseen = [replace(r, valid=r.valid & held_out) for r in (before, after)]
    return FittedCurve(
        curve,
        candidate,
        parent,
        compute_evidence(before, after, pool.block_length),
        compute_evidence(unseen[0], unseen[1], pool.block_length),
    )


def _give_prior(curve: CurveEffect, deviation: float) -> EffectModel:
    """Return a curve's model with the prior deviations of its coefficients and of its growth."""
    deviations = (deviation,) * curve.function.basis.size + (_GROWTH_DEVIATION,) * curve.at.grows_with_drive
    return replace(curve.model, prior_deviations=deviations)


def _find_linear_solution(problem: Problem, unknowns: Array, screened: ScreenedCurve) -> Array:
    """Return the unknowns (U,) of the fit at the end of the linear model."""
    curve, evidence = screened
    first = problem.layout.per_log.start
    columns = slice(first, first + len(curve.linear_model.quantities))
    moved = unknowns + np.delete(evidence.step, columns)
    coefficients = evidence.step[columns]
    linear = curve.linear_model.form.function
    if not isinstance(linear, LinearGrowth):
        return insert_effect_unknowns(problem, moved, coefficients)
    level, growth = linear.separate(coefficients)
    return insert_effect_unknowns(problem, moved, curve.model.to_search((*level, growth)))


def _search_line(problem: Problem, start: Array, target: Array) -> Array:
    """Return the point with the smallest cost between two, inside the bounds."""
    low, high = problem.get_bounds()
    points = [np.clip(start + part * (target - start), low, high) for part in (1.0, 0.5, 0.2, 0.05, 0.0)]
    return min(points, key=problem.compute_cost)

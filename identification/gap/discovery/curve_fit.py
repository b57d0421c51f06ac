"""Fit of curves together with the law and the effects that are already named."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.fitting import EffectModel, OptimiserSettings, Problem, fit_output_error, minimise
from identification.gap.data import compute_residual_correlation_length, find_strongest_line, split_by_piece
from identification.gap.discovery.curve_basis import LinearGrowth
from identification.gap.discovery.curve_effects import (
    HISTORY_VARIABLES,
    CurveEffect,
    CurvePlace,
    list_curve_effects,
    make_fine_curve,
)
from identification.gap.discovery.curve_evidence import CurveEvidence, compute_curve_evidence
from identification.gap.fits import Candidate, JointFit, insert_effect_unknowns
from identification.gap.selection import CandidatePool
from identification.progress import ignore_progress
from identification.threads import use_one_thread

_FITTED_CURVES = 7
"""Number of curves with the largest linear evidence that are fitted, with and without growth counted once."""
_FIRST_ITERATIONS = 8
"""Largest number of iterations of a first fit, after which the best are continued."""
_FINISHED_CURVES = 2
"""Number of the best of these that are also fitted from the regression, with their prior estimated again."""
_ITERATIONS = 20
"""Largest number of iterations of a fit."""
_SMALLEST_DEVIATION = 1e-8
"""Smallest prior deviation [1]: a curve of zero keeps one."""
_FRESH_FIT = OptimiserSettings(iterations=_ITERATIONS, restarts=0, holds_shape=True)
"""Fit from the regression."""
_VARIABLE_PENALTY = 0.03
"""Relative decrease of the error that one more variable or effect has to bring."""
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
    """Block evidence for the curve over the set without it, on all samples."""

    @property
    def loss(self) -> float:
        """Logarithm of the error [N], on the worse of fitted and held-out strokes, with a penalty for its size."""
        at = self.curve.at
        count = len(at.variables) + any(v in HISTORY_VARIABLES for v in at.variables)
        error = max(self.candidate.train_rmse, self.candidate.held_out_rmse)
        return math.log(error) + _VARIABLE_PENALTY * (count + len(self.candidate.fit.effects))

    @property
    def chance(self) -> float:
        """Difference of two losses that the sampling of the noise alone can produce."""
        return 0.5 * math.log1p(self.candidate.chance_excess)

    @property
    def values(self) -> tuple[float, ...]:
        """Coefficients of the curve."""
        return self.candidate.fit.active_effects[-1].values

    @property
    def covariance(self) -> Array:
        """(P, P) covariance of these coefficients."""
        columns = self.candidate.fit.problem.layout.effect_slices[-1]
        return np.asarray(self.candidate.fit.covariance.unknowns[columns, columns])


def screen_curves(pool: CandidatePool, parent: Candidate) -> list[ScreenedCurve]:
    """Return all curves that the recording can show, with their linear evidence, the largest first."""
    problem = pool.problems.screening.replace_effects(parent.fit.effects)
    unknowns = parent.fit.minimum.unknowns
    simulated = problem.simulate(unknowns)
    line, _ = find_strongest_line(parent.residual)
    finest = min(p.excitation.rate for p in pool.problems.decimated.pieces)
    screened = []
    for curve in list_curve_effects(problem, simulated, line, finest):
        own = choose_problem(pool, curve.at).replace_effects(parent.fit.effects)
        evidence = _screen_curve(own, unknowns, curve)
        # The odds of a curve do not grow with the rate at which it is screened.
        comparable = evidence._replace(log_odds=evidence.log_odds * problem.samples / own.samples)
        screened.append(ScreenedCurve(curve, comparable))
    return sorted(screened, key=lambda s: -s.evidence.log_odds)


def choose_problem(pool: CandidatePool, at: CurvePlace) -> Problem:
    """Return the law on the data on which a curve is fitted: a step response needs the finer ones."""
    return pool.problems.decimated if at.is_response else pool.problems.screening


def _screen_curve(problem: Problem, unknowns: Array, curve: CurveEffect) -> CurveEvidence:
    joint = problem.replace_effects((*problem.effects, curve.linear_model))
    count, first = len(curve.linear_model.quantities), problem.layout.per_log.start
    start = insert_effect_unknowns(problem, unknowns, np.zeros(count))
    return compute_curve_evidence(joint, joint.evaluate(start), start, slice(first, first + count))


def fit_best_curves(
    pool: CandidatePool, parent: Candidate, screened: Sequence[ScreenedCurve]
) -> list[FittedCurve]:
    """Fit the curves with the largest linear evidence, and return the most probable first.

    All are fitted from the end of their linear model. The best of these are also fitted from the regression:
    without the curve, the law may have moved to values that hide it. The curve with the largest linear evidence is
    fitted from the regression as well, because a first fit of a large curve may stay at such values.
    """
    warm = [_continue_linear_model(pool, parent, s) for s in _drop_variants(screened)[:_FITTED_CURVES]]
    best = sorted(range(len(warm)), key=lambda i: warm[i].loss)
    chosen = {0, *best[:_FINISHED_CURVES]}
    fitted = [_finish_fit(pool, f) if i in chosen else f for i, f in enumerate(warm)]
    simpler = _find_simpler(screened, fitted)
    if simpler is not None:
        fitted.append(_finish_fit(pool, _continue_linear_model(pool, parent, simpler)))
    return sorted(fitted, key=lambda f: f.loss)


def fit_fine_curves(
    pool: CandidatePool, parent: Candidate, screened: Sequence[ScreenedCurve]
) -> list[FittedCurve]:
    """Fit the fine curves over time that have more linear evidence than any other curve.

    ``screened`` are the other curves with the same set, the largest evidence first.
    """
    problem, unknowns = pool.problems.screening.replace_effects(parent.fit.effects), parent.fit.minimum.unknowns
    places = [s.curve.at for s in screened if s.curve.at.is_over_time and not s.curve.at.period]
    fine = [make_fine_curve(problem, at) for at in places]
    found = [ScreenedCurve(c, _screen_curve(problem, unknowns, c)) for c in fine]
    likely = [s for s in found if s.evidence.log_odds > screened[0].evidence.log_odds]
    return [_finish_fit(pool, _continue_linear_model(pool, parent, s)) for s in likely]


def _find_simpler(screened: Sequence[ScreenedCurve], fitted: Sequence[FittedCurve]) -> ScreenedCurve | None:
    """Return the best curve without its growth with the drive, if it has one."""
    at = min(fitted, key=lambda f: f.loss).curve.at if fitted else None
    if at is None or not at.grows_with_drive:
        return None
    simpler = at._replace(variables=at.variables[:-1], grows_with_drive=False)
    return next((s for s in screened if s.curve.at == simpler), None)


def _drop_variants(screened: Sequence[ScreenedCurve]) -> list[ScreenedCurve]:
    """Return the curves without the less probable of two that differ in their growth with the drive alone."""
    best: dict[CurvePlace, ScreenedCurve] = {}
    for s in screened:
        at = s.curve.at
        variables = at.variables[:-1] if at.grows_with_drive else at.variables
        best.setdefault(at._replace(variables=variables, grows_with_drive=False), s)
    return list(best.values())


def _continue_linear_model(pool: CandidatePool, parent: Candidate, screened: ScreenedCurve) -> FittedCurve:
    """Fit a curve with the law and the effects of a set, from the end of its linear model."""
    curve, evidence = screened
    model = _set_prior(curve, evidence.deviation)
    parent_problem = choose_problem(pool, curve.at).replace_effects(parent.fit.effects)
    problem = parent_problem.replace_effects((*parent.fit.effects, model))
    start = insert_effect_unknowns(parent_problem, parent.fit.minimum.unknowns, np.zeros(len(model.quantities)))
    target = _find_linear_solution(parent_problem, parent.fit.minimum.unknowns, screened)
    with use_one_thread():
        minimum = minimise(problem, _search_line(problem, start, target), _FIRST_ITERATIONS, ignore_progress)
    return _evaluate_curve(pool, parent, curve, JointFit(problem, minimum))


def _finish_fit(pool: CandidatePool, fitted: FittedCurve) -> FittedCurve:
    """Fit a curve from the regression as well, and estimate its prior again."""
    fit, curve = fitted.candidate.fit, fitted.curve
    with use_one_thread():
        if not pool.is_at_floor(fitted.candidate):
            again = minimise(fit.problem, fit.minimum.unknowns, _ITERATIONS, ignore_progress)
            fit = JointFit(fit.problem, again)
            fresh = _replace_law(fit.problem, fit.minimum.unknowns, pool.problems.regression_start)
            other = fit_output_error(fit.problem, _FRESH_FIT, start=fresh)
            if other.evaluation.cost < fit.minimum.evaluation.cost:
                fit = JointFit(fit.problem, other)
        fit = _update_prior(fit, curve)
    return _evaluate_curve(pool, fitted.parent, curve, fit)


def _replace_law(problem: Problem, unknowns: Array, law: Array) -> Array:
    """Return unknowns (U,) with coordinates, delays and y(0) of a law alone, and the effects' values kept."""
    moved = unknowns.copy()
    first = problem.layout.effects.start
    moved[:first] = law[:first]
    return moved


def _evaluate_curve(pool: CandidatePool, parent: Candidate, curve: CurveEffect, fit: JointFit) -> FittedCurve:
    """Return a fitted curve with its block evidence over the set without it."""
    candidate = pool.evaluate(fit)
    return FittedCurve(curve, candidate, parent, pool.comparison.compute_evidence(parent, candidate))


def refit_curve(pool: CandidatePool, fitted: FittedCurve) -> Candidate:
    """Refine a curve on all samples, with the prior deviation for the longer correlation of their errors."""
    candidate, fit = fitted.candidate, fitted.candidate.fit
    ratio = compute_residual_correlation_length(fit.force_errors) / compute_full_correlation_length(
        pool, candidate
    )
    model = _set_prior(fitted.curve, fit.effects[-1].prior_deviations[0] * math.sqrt(ratio))
    problem = fit.problem.replace_effects((*fit.effects[:-1], model))
    return pool.refit_all_samples(replace(candidate, fit=JointFit(problem, fit.minimum)))


def compute_full_correlation_length(pool: CandidatePool, candidate: Candidate) -> float:
    """Return the correlation length of a candidate's residual [samples], on all samples of the recording."""
    return compute_residual_correlation_length(
        split_by_piece(candidate.residual.values, pool.problems.full.pieces)
    )


def _update_prior(fit: JointFit, curve: CurveEffect) -> JointFit:
    """Continue a fit with the prior deviation that its coefficients suggest (MacKay 1992, eq. 2.17).

    The linear model counts its whole residual as noise, so its prior is too narrow for a large curve. Samples with
    the same error count as one: in slow noise, all samples together would overrule the prior where the held-out
    strokes leave a gap.
    """
    problem, unknowns = fit.problem, fit.minimum.unknowns
    columns = problem.layout.effect_slices[-1]
    inner = slice(columns.start, columns.start + curve.function.basis.size)
    variance = max(fit.ratio**2, 1.0) * compute_residual_correlation_length(fit.force_errors)
    # The curvature of a coefficient of which nothing is known is that of its prior alone.
    known = (
        1.0
        - np.diag(np.linalg.pinv(fit.minimum.evaluation.hessian))[inner]
        / problem.effects[-1].prior_deviations[0] ** 2
    )
    determined = max(float(np.sum(np.clip(known, 0.0, 1.0))), 1.0)
    deviation = float(np.sqrt(np.sum(unknowns[inner] ** 2) / determined / variance))
    model = _set_prior(curve, max(deviation, _SMALLEST_DEVIATION))
    again = problem.replace_effects((*problem.effects[:-1], model))
    return JointFit(again, minimise(again, unknowns, _ITERATIONS, ignore_progress))


def _set_prior(curve: CurveEffect, deviation: float) -> EffectModel:
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

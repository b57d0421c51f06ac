"""Search for a cause outside the library: where it acts, on which variable, its curve, and the shortest formula.

A curve is tried at every place and over every variable, with the law alone and with the named effects. The most
probable one is kept if it closes part of the gap on strokes that no fit used. A formula then replaces the curve if
it does as well. The remaining residual is searched once more.

Curves at several places may do equally well. The one with the shortest formula is then reported.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from identification.gap.discovery.curve_fit import (
    FittedCurve,
    fit_best_curves,
    fit_fine_curves,
    refit_curve,
    screen_curves,
)
from identification.gap.discovery.formula_fit import FittedFormula, find_formula
from identification.gap.fits import Candidate
from identification.gap.selection import CandidatePool

_MIN_CLOSED_PART = 0.2
"""Smallest part of the gap on held-out strokes that a discovered effect closes [1]."""
_MIN_LOG_ODDS = 3.0
"""Smallest log odds on all samples, for each variable of a curve.

Rare events, such as steps of the drive, are on few held-out strokes. A curve has too few coefficients to fit the
noise of many blocks.
"""
_PLACES = 2
"""Largest number of places that are found one after the other."""


@dataclass(frozen=True)
class DiscoveredEffect:
    """A cause outside the library."""

    fitted: FittedCurve
    formula: FittedFormula | None
    candidate: Candidate
    """The set with the formula, or else the curve, fitted on all samples."""
    further: tuple[FittedCurve, ...] = ()
    """Curves found after it in the remaining residual."""


def discover_effect(pool: CandidatePool, named: Candidate) -> DiscoveredEffect | None:
    """Return the cause outside the library that closes most of the gap; None if no curve closes part of it.

    Args:
        pool: the fitted sets.
        named: the named set; the law alone if none is named.
    """
    parents = [pool.baseline] if not named.names else [pool.baseline, named]
    screened = [(parent, screen_curves(pool, parent)) for parent in parents]
    found = [f for parent, curves in screened for f in fit_best_curves(pool, parent, curves)]
    fine = [f for parent, curves in screened for f in fit_fine_curves(pool, parent, curves)]
    best = _choose_finding(pool, found, fine)
    if best is None:
        return None
    chosen = pool.refit_all_samples(best.judged.candidate) if best.formula else refit_curve(pool, best.fitted)
    # The curve that is reported belongs to the law that is reported.
    reported = best.fitted if best.formula else replace(best.fitted, candidate=chosen)
    # What a fine curve leaves in the strokes that were left out says nothing about a further cause.
    first = best.judged if best.fitted.curve.at.is_fine else best.fitted
    return DiscoveredEffect(reported, best.formula, chosen, _find_further(pool, first))


class _Finding(NamedTuple):
    """A fitted curve with its formula."""

    fitted: FittedCurve
    formula: FittedFormula | None
    judged: FittedCurve
    """The same curve with the set of its formula; without a formula, with its own."""

    @property
    def length(self) -> float:
        """Number of fitted parameters of the formula; infinite without one."""
        if self.formula is None:
            return math.inf
        return sum(p.lo < p.hi for p in self.formula.file.parameters.values())


def _choose_finding(
    pool: CandidatePool, found: Sequence[FittedCurve], fine: Sequence[FittedCurve] = ()
) -> _Finding | None:
    """Return the curve that is reported; None if no curve closes part of the gap.

    Of several whose errors differ by no more than chance, it is the one with the shortest formula. A change over
    time that is quicker than the strokes is unknown in those that were left out. So a fine curve is judged by its
    formula alone.
    """
    accepted = [_Finding(f, None, f) for f in found if _is_accepted(pool, f)]
    findings = [_add_formula(pool, x.fitted) for x in _select_equal(accepted)]
    findings += [x for f in fine if _is_certain(f) and (x := _add_formula(pool, f)).formula is not None]
    return min(_select_equal(findings), key=lambda x: (x.length, x.judged.loss), default=None)


def _select_equal(findings: Sequence[_Finding]) -> list[_Finding]:
    """Return the findings with the smallest error, or with one that differs from it by no more than chance."""
    smallest = min((x.judged.loss for x in findings), default=math.inf)
    return [x for x in findings if x.judged.loss <= smallest + x.judged.chance]


def _add_formula(pool: CandidatePool, fitted: FittedCurve) -> _Finding:
    """Return a curve with its formula, or without one if none closes part of the gap."""
    formula = find_formula(pool, fitted)
    if formula is not None:
        odds = pool.comparison.compute_evidence(fitted.parent, formula.candidate)
        judged = replace(fitted, candidate=formula.candidate, log_odds=odds)
        if _is_accepted(pool, judged):
            return _Finding(fitted, formula, judged)
    return _Finding(fitted, None, fitted)


def _find_curves(pool: CandidatePool, parent: Candidate) -> list[FittedCurve]:
    return fit_best_curves(pool, parent, screen_curves(pool, parent))


def _find_further(pool: CandidatePool, first: FittedCurve) -> tuple[FittedCurve, ...]:
    """Return the curves that are accepted one after the other in the residual of the first."""
    found = [first]
    while len(found) < _PLACES and not pool.is_at_floor(found[-1].candidate):
        parent = found[-1].candidate
        accepted = [f for f in _find_curves(pool, parent) if _is_accepted(pool, f)]
        if not accepted:
            break
        found.append(min(accepted, key=lambda f: f.loss))
    return tuple(found[1:])


def _is_accepted(pool: CandidatePool, fitted: FittedCurve) -> bool:
    """Return True if a curve improves the fit beyond chance and closes part of the gap on held-out strokes."""
    parent, candidate, floor = fitted.parent, fitted.candidate, pool.floor
    gap = parent.held_out_rmse**2 - floor**2
    if gap <= 0.0 or not _is_certain(fitted):
        return False
    closed = (parent.held_out_rmse**2 - candidate.held_out_rmse**2) / gap
    interval = pool.evaluation.estimate_shares(
        parent.residual, candidate.residual, {"curve": parent.residual}, candidate.held_out_rmse, floor
    )["curve"][1]
    return closed > _MIN_CLOSED_PART and interval[0] > 0.0


def _is_certain(fitted: FittedCurve) -> bool:
    """Return True if a curve improves the fit beyond chance."""
    return fitted.log_odds >= _MIN_LOG_ODDS * len(fitted.curve.at.variables)

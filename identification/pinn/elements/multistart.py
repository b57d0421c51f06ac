"""Several starts of the network of elements, and the choice among them.

A start has converged when the network's force reaches the noise and the law is satisfied. No simulation is used
for this decision.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from identification.arrays import Array
from identification.fitting import Piece, Problem
from identification.logs import Stretch
from identification.pinn.common import (
    ElementSettings,
    TrainingMonitor,
    TrainingOutcome,
    TrainingStopped,
    generate_starts,
    make_training_pieces,
    reconstruct_force,
)
from identification.pinn.elements.trained_network import TrainedNetwork
from identification.pinn.elements.training import ElementTraining
from identification.uncertainty import reestimate_motion

_CONVERGED_RATIO = 1.015
"""Threshold on the force misfit over the noise [1]: up to it, a start counts as converged."""
_ACCEPTED_RATIO = 1.05
"""The same threshold for the result, which also contains the motion's noise and the floor's uncertainty."""
_LAW_TOLERANCE = 2e-2
"""Threshold on the hysteresis residual at points, over the slip velocity at breakthrough [1]: up to it, the law is
satisfied.

Weighted residuals are far smaller; a sharp knee leaves a hundredth at points of a correct solution.
"""
_SAME_MISFIT = 1e-2
"""Threshold on the relative difference of two misfits [1]: below it, two starts ended in the same minimum."""
_MIN_PIECE_LENGTH = 2.0
"""Smallest length of each piece of the data on which starts are compared [s]."""
_REQUIRED_AGREEMENTS = 1
"""Number of further starts that must end in the best one's minimum before the search stops."""


@dataclass(frozen=True)
class _BestStart:
    """The best of the starts so far."""

    training: ElementTraining
    result: TrainedNetwork
    attempts: int
    agreements: int
    """Number of further starts that ended in the same minimum."""


def train_elements(
    problem: Problem,
    validation: Sequence[Array],
    settings: ElementSettings,
    monitor: TrainingMonitor,
    stretches: Sequence[Stretch] | None,
) -> tuple[TrainingOutcome, TrainingOutcome]:
    """Return the outcome of the best start, and its outcome before the validation blocks were fitted.

    Args:
        problem: problem to learn.
        validation: validation mask (N,) of each piece.
        settings: settings of the network.
        monitor: progress, stop requests and budget.
        stretches: recordings behind the pieces, to estimate the motion again; None to keep the motion.
    """
    split = problem.exclude_samples(validation)
    opening = _select_opening(split, settings.opening_length)
    best = _find_best_start(opening, settings, monitor)
    blind = _make_outcome(opening, best)
    try:
        whole = _reestimate_motion(problem, stretches, blind) if settings.refit_on_all else split
        best = replace(best, result=best.training.finish(whole, restart=opening is not split))
    except TrainingStopped as stopped:
        return replace(blind, accepted=False, note=f"{stopped} before the last stage"), blind
    final = _make_outcome(whole, best)
    return final, blind if settings.refit_on_all else final


def _select_opening(problem: Problem, length: float) -> Problem:
    """Return the problem with the first part of each piece, if all pieces together exceed a length [s]."""
    total = sum(float(p.train.sum()) / p.excitation.rate for p in problem.pieces)
    if total <= length:
        return problem
    return problem.replace_training([_mask_opening(p, length / total) for p in problem.pieces])


def _mask_opening(piece: Piece, share: float) -> Array:
    """Return the training mask (N,) of a piece's first part: a share of its samples, with a least length."""
    fitted = np.flatnonzero(piece.train)
    count = max(round(share * len(fitted)), round(_MIN_PIECE_LENGTH * piece.excitation.rate))
    last = fitted[min(count, len(fitted)) - 1]
    return np.where(np.arange(len(piece.train)) <= last, piece.train, 0.0)


def _find_best_start(problem: Problem, settings: ElementSettings, monitor: TrainingMonitor) -> _BestStart:
    """Train starts until one has converged, or another one ended in the best one's minimum."""
    best: _BestStart | None = None
    for attempts, start in enumerate(islice(generate_starts(problem), settings.max_starts), 1):
        training = ElementTraining(problem, settings, monitor, start)
        try:
            candidate = _BestStart(training, training.run(), attempts, 0)
        except TrainingStopped:
            if best is None:
                raise
            return best
        best = _choose_better(problem, best, candidate)
        if best.agreements == _REQUIRED_AGREEMENTS or _has_converged(problem, best.result):
            break
    if best is None:
        raise TrainingStopped("there was no start")
    return best


def _choose_better(problem: Problem, best: _BestStart | None, candidate: _BestStart) -> _BestStart:
    """Return the better of two starts, with the number of starts that ended in its minimum."""
    if best is None:
        return candidate
    oscillation = _measure_oscillation(best.training) + _measure_oscillation(candidate.training)
    ratio = candidate.result.misfit.force / best.result.misfit.force
    is_same = abs(ratio - 1.0) < max(_SAME_MISFIT, oscillation)
    is_better = _compute_merit(problem, candidate.result) < _compute_merit(problem, best.result)
    winner = candidate if is_better else best
    return replace(
        winner,
        attempts=candidate.attempts,
        agreements=best.agreements + 1 if is_same else winner.agreements * (winner is best),
    )


def _measure_oscillation(training: ElementTraining) -> float:
    """Return the relative change of the misfit on the last mesh [1], large if the law cannot fit the data."""
    last = [record.force for record in training.history[-2:] if record.phase == training.phase]
    return abs(last[-1] / last[0] - 1.0)


def _has_converged(problem: Problem, result: TrainedNetwork) -> bool:
    return result.misfit.force <= _CONVERGED_RATIO * problem.noise and _is_law_satisfied(result)


def _is_law_satisfied(result: TrainedNetwork) -> bool:
    """Return whether the law is satisfied as far as the basis functions can follow the stroke."""
    return bool(result.misfit.hysteresis <= np.hypot(_LAW_TOLERANCE, result.misfit.unresolved))


def _compute_merit(problem: Problem, result: TrainedNetwork) -> float:
    """Return the merit of a start [1], lower for better ones: misfit over noise, and law residual."""
    return result.misfit.force / problem.noise + 10.0 * result.misfit.hysteresis


def _reestimate_motion(problem: Problem, stretches: Sequence[Stretch] | None, blind: TrainingOutcome) -> Problem:
    """Return the problem with its motion estimated again, with compliance motion from the network's own force."""
    if stretches is None or not blind.accepted:
        return problem
    forces = [np.where(np.isfinite(f), f, p.force) for f, p in zip(blind.forces, problem.pieces, strict=True)]
    return reestimate_motion(problem, stretches, forces)


def _make_outcome(problem: Problem, best: _BestStart) -> TrainingOutcome:
    result = best.result
    velocity = result.network.evaluate_inner_velocity
    return TrainingOutcome(
        unknowns=result.unknowns,
        covariance=result.compute_covariance(problem),
        forces=tuple(
            reconstruct_force(p, i, velocity, result.unknowns, problem)
            for i, p in enumerate(make_training_pieces(problem))
        ),
        accepted=_is_law_satisfied(result)
        and (result.misfit.force <= _ACCEPTED_RATIO * problem.noise or best.agreements > 0),
        note=_describe_training(problem, best),
        steps=result.steps,
        history=tuple(best.training.history),
    )


def _describe_training(problem: Problem, best: _BestStart) -> str:
    """Return how the training ended, as text for a person."""
    misfit, ratio = best.result.misfit, best.result.misfit.force / problem.noise
    starts = f"best of {best.attempts} starts" if best.attempts > 1 else "first start"
    law = f"the law residual is {100 * misfit.hysteresis:.1g} % of the slip velocity at breakthrough"
    if ratio <= _ACCEPTED_RATIO:
        return f"{starts}; the network's force reaches the noise ({ratio:.3f} of it), {law}"
    agreed = f"{best.agreements} more ended there too" if best.agreements else "no other ended there"
    return f"{starts}, {agreed}; the network's force stays at {ratio:.3g} times the noise, {law}"

"""Starts of the local network, and its own judgement of where they ended.

A start counts when the network's force reaches the noise while the law is kept; nothing is simulated to decide.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from identification.arrays import Array
from identification.motion_noise import with_motion
from identification.piece import Piece
from identification.pinn.batches import learned
from identification.pinn.beginning import starts
from identification.pinn.local import LocalTraining, Trained
from identification.pinn.reconstruct import recorded_force
from identification.pinn.result import Outcome
from identification.pinn.settings import LocalSettings
from identification.pinn.supervision import Stopped, Supervision
from identification.problem import Problem
from identification.recordings import Stretch

_REACHED = 1.015
"""[1] force misfit over the noise up to which a start counts as arrived."""
_NEAR = 1.05
"""[1] the same in the end, where the motion's noise and an uncertain floor count as well."""
_KEPT = 2e-2
"""[1] residual of the hysteresis, point by point and over the slip velocity at breakthrough, up to which the law
counts as kept: in the mean it is kept far better, and a sharp knee leaves a hundredth where all is right."""
_SAME = 1e-2
"""[1] relative difference of two misfits below which they count as the same minimum."""
_ENOUGH, _LEAST = 40.0, 2.0
"""[s] of all pieces together, and of each at least, that the starts are judged on."""
_AGREED = 1
"""Further starts that must end in the best one's minimum before it is taken for all there is."""


@dataclass(frozen=True)
class _Best:
    """The best of the starts so far."""

    training: LocalTraining
    found: Trained
    tried: int
    agreed: int
    """Further starts that ended in the same minimum."""


def train_local(
    problem: Problem,
    held: Sequence[Array],
    settings: LocalSettings,
    supervision: Supervision,
    stretches: Sequence[Stretch] | None,
) -> tuple[Outcome, Outcome]:
    """The best of some starts, and the same before the blocks set aside were taken back."""
    split = problem.without(held)
    opening = _opening(split)
    best = _best(opening, settings, supervision)
    blind = _outcome(opening, best)
    try:
        whole = _smoother_motion(problem, stretches, blind) if settings.take_back else split
        best = replace(best, found=best.training.finish(whole, longer=opening is not split))
    except Stopped as stopped:
        return replace(blind, accepted=False, note=f"{stopped} before the last descent"), blind
    final = _outcome(whole, best)
    return final, blind if settings.take_back else final


def _opening(problem: Problem) -> Problem:
    """The beginning of each piece, where all of them are more than a start needs to be judged."""
    total = sum(float(p.train.sum()) / p.stroke.rate for p in problem.pieces)
    if total <= _ENOUGH:
        return problem
    return problem.with_training([_beginning(p, _ENOUGH / total) for p in problem.pieces])


def _beginning(piece: Piece, share: float) -> Array:
    """Samples (N,) to learn from: a share of those fitted, and not too few."""
    fitted = np.flatnonzero(piece.train)
    last = fitted[min(max(round(share * len(fitted)), round(_LEAST * piece.stroke.rate)), len(fitted)) - 1]
    return np.where(np.arange(len(piece.train)) <= last, piece.train, 0.0)


def _best(problem: Problem, settings: LocalSettings, supervision: Supervision) -> _Best:
    """Starts until one arrives, or several agree that there is nothing better."""
    best: _Best | None = None
    for tried, start in enumerate(islice(starts(problem), settings.starts), 1):
        training = LocalTraining(problem, settings, supervision, start)
        try:
            now = _Best(training, training.run(), tried, 0)
        except Stopped:
            if best is None:
                raise
            return best
        best = _better(problem, best, now)
        if best.agreed == _AGREED or _arrived(problem, best.found):
            break
    if best is None:
        raise Stopped("there was no start")
    return best


def _better(problem: Problem, best: _Best | None, now: _Best) -> _Best:
    """The better of two, and whether the other one agrees with it."""
    if best is None:
        return now
    wavering = _wavering(best.training) + _wavering(now.training)
    same = abs(now.found.misfit.force / best.found.misfit.force - 1.0) < max(_SAME, wavering)
    winner = now if _badness(problem, now.found) < _badness(problem, best.found) else best
    return replace(winner, tried=now.tried, agreed=best.agreed + 1 if same else winner.agreed * (winner is best))


def _wavering(training: LocalTraining) -> float:
    """[1] by which the misfit still changed on the last mesh: what no law follows lets the elements waver."""
    last = [moment.force for moment in training.history[-2:] if moment.phase == training.phase]
    return abs(last[-1] / last[0] - 1.0)


def _arrived(problem: Problem, found: Trained) -> bool:
    return found.misfit.force <= _REACHED * problem.noise and _kept(found)


def _kept(found: Trained) -> bool:
    """Whether the law is kept, as far as the functions of an element can follow the stroke at all."""
    return bool(found.misfit.hysteresis <= np.hypot(_KEPT, found.misfit.unresolved))


def _badness(problem: Problem, found: Trained) -> float:
    """[1] what orders the starts: misfit over noise, and how far the law is broken."""
    return found.misfit.force / problem.noise + 10.0 * found.misfit.hysteresis


def _smoother_motion(problem: Problem, stretches: Sequence[Stretch] | None, blind: Outcome) -> Problem:
    """The problem with its motion estimated again, the actuator giving way under the network's own force.

    The recorded force would bring its noise into the motion, and what is common to both biases what is learned.
    """
    if stretches is None or not blind.accepted:
        return problem
    forces = [np.where(np.isfinite(f), f, p.force) for f, p in zip(blind.forces, problem.pieces, strict=True)]
    pieces = [
        with_motion(piece, replace(stretch, force=force))
        for piece, stretch, force in zip(problem.pieces, stretches, forces, strict=True)
    ]
    return replace(problem, pieces=tuple(pieces))


def _outcome(problem: Problem, best: _Best) -> Outcome:
    found = best.found
    velocity = found.network.inner_velocity
    return Outcome(
        unknowns=found.unknowns,
        covariance=found.covariance(problem),
        forces=tuple(
            recorded_force(p, i, velocity, found.unknowns, problem) for i, p in enumerate(learned(problem))
        ),
        accepted=_kept(found) and (found.misfit.force <= _NEAR * problem.noise or best.agreed > 0),
        note=_note(problem, best),
        steps=found.steps,
        history=tuple(best.training.history),
    )


def _note(problem: Problem, best: _Best) -> str:
    """How the training ended, in words."""
    found, ratio = best.found, best.found.misfit.force / problem.noise
    words = f"best of {best.tried} starts" if best.tried > 1 else "first start"
    kept = f"the law is kept to {100 * found.misfit.hysteresis:.1g} % of the slip velocity at breakthrough"
    if ratio <= _NEAR:
        return f"{words}; the network's force reaches the noise ({ratio:.3f} of it), {kept}"
    agreed = f"{best.agreed} more end there too" if best.agreed else "no other ends there"
    return f"{words}, {agreed}; the network's force stays at {ratio:.3g} times the noise, {kept}"

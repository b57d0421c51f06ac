"""Training of a chosen network on a problem, and the two figures that it is judged by."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.damper.coordinates import Coordinates
from identification.errors import IdentificationError
from identification.piece import Piece
from identification.pinn.effect_terms import effect_deviations, takes
from identification.pinn.local_runs import train_local
from identification.pinn.result import Errors, Outcome, PinnResult
from identification.pinn.settings import GlobalSettings, LocalSettings, PaperSettings
from identification.pinn.split import validation_masks
from identification.pinn.supervision import Supervision
from identification.prediction import predict_piece, rmse
from identification.problem import COORDINATE_COUNT, Problem
from identification.recordings import Stretch
from identification.simulate import ActiveEffect
from identification.threads import one_thread

_MOST, _ON_A_PROCESSOR = 16, 1
"""Dampers in one batch. On an accelerator their Jacobians take some 0.3 GB each, with what they are made from; a
processor is full with one, and the numbers of more only leave its caches."""


def train(
    problem: Problem,
    settings: LocalSettings | GlobalSettings | PaperSettings,
    supervision: Supervision | None = None,
    stretches: Sequence[Stretch] | None = None,
) -> PinnResult:
    """Train a network and judge what it found.

    No simulation enters the training; one is run afterwards, to judge.

    Args:
        problem: recordings, noise, bounds.
        settings: which network, and how.
        supervision: progress, stop and budget.
        stretches: the recordings behind the pieces, where the motion may be estimated again.

    Raises:
        Stopped: before anything was found.
        IdentificationError: an effect that this network cannot take in.
    """
    if why := why_not(problem, settings):
        raise IdentificationError(why)
    if isinstance(settings, GlobalSettings):
        return train_batch([problem], settings, supervision)[0]
    supervision = supervision or Supervision()
    held = validation_masks(problem.pieces, settings.validation_share, settings.seed)
    with one_thread():
        outcome, blind = _network(settings)(problem, held, settings, supervision, stretches)
    seconds = supervision.seconds
    return _judged(problem, held, settings.network, outcome, blind, seconds)


def train_batch(
    problems: Sequence[Problem], settings: GlobalSettings, supervision: Supervision | None = None
) -> list[PinnResult]:
    """Train the global network on several dampers of one size, in the same steps.

    Each has a network, parameters and a judgement of its own, and ends where it would alone, but for rounding. Its
    seconds are its share of the batch's.

    Args:
        problems: one a damper.
        settings: of the network.
        supervision: of all of them; what stops one stops all.

    Raises:
        Stopped: before anything was found.
    """
    import torch

    from identification.pinn.global_runs import train_global

    torch.set_num_threads(1)
    supervision = supervision or Supervision()
    held = [validation_masks(p.pieces, settings.validation_share, settings.seed) for p in problems]
    with one_thread():
        outcomes = train_global(problems, held, settings, supervision)
    seconds = supervision.seconds / len(problems)
    return [
        _judged(problem, aside, settings.network, outcome, blind, seconds)
        for problem, aside, (outcome, blind) in zip(problems, held, outcomes, strict=True)
    ]


def batches(problems: Sequence[Problem], settings: GlobalSettings) -> list[list[int]]:
    """Numbers of the dampers that can be trained together, batch by batch.

    They bring as many stretches, and as many samples in a step; how long they were recorded beyond that does not
    matter. On a processor each is a batch of its own.
    """
    from identification.pinn.global_runs import batch_size

    alike = dict[tuple[int, int], list[int]]()
    for number, problem in enumerate(problems):
        alike.setdefault(batch_size(problem, settings), []).append(number)
    most = _ON_A_PROCESSOR if settings.device == "cpu" else _MOST
    return [some[k : k + most] for some in alike.values() for k in range(0, len(some), most)]


def why_not(problem: Problem, settings: LocalSettings | GlobalSettings | PaperSettings) -> str:
    """Why a network cannot learn a problem, in words; empty where it can."""
    if not isinstance(settings, LocalSettings):
        words = f"the {settings.network} network knows the law alone, of one damper in one condition"
        return f"{words}; say --preset local" if problem.effects or problem.own else ""
    strange = [f"{c.name} ({c.form_name})" for c in problem.effects if not takes(c.form)]
    if strange:
        return (
            f"{strange[0]} makes the damper's own motion, or what the force channel remembers, a state that the "
            "network does not have; fit it by simulation"
        )
    return ""


def _network(settings: LocalSettings | PaperSettings) -> Callable[..., tuple[Outcome, Outcome]]:
    """The training of a kind of network; the other one stays unloaded, and torch with it."""
    if isinstance(settings, LocalSettings):
        return train_local
    import torch

    from identification.pinn.paper_runs import train_paper

    torch.set_num_threads(1)
    return train_paper


def _judged(
    problem: Problem, held: Sequence[Array], network: str, outcome: Outcome, blind: Outcome, seconds: float
) -> PinnResult:
    """The outcome with its errors; ``blind`` is the one that had not seen the blocks set aside."""
    # y(0) is a parameter too: it must not be fitted to the blocks that judge it.
    seen = problem.without(held)
    point, delays, effects = _resolved(problem, outcome)
    simulated, judged = (_simulated(seen, one) for one in (outcome, blind))
    q, covariance, own = outcome.unknowns[:COORDINATE_COUNT], None, np.full(problem.effect_count, np.nan)
    if outcome.covariance is not None:
        D = problem.space.slopes(q)
        covariance = D @ outcome.covariance[:COORDINATE_COUNT, :COORDINATE_COUNT] @ D.T
        own = effect_deviations(problem, outcome.unknowns, outcome.covariance)
    return PinnResult(
        network=network,
        coordinates=point,
        unknowns=outcome.unknowns,
        covariance=outcome.covariance,
        coordinate_covariance=covariance,
        delays=delays,
        effects=effects,
        effect_deviations=own,
        reconstruction=_errors(problem.pieces, held, outcome.forces, blind.forces),
        simulation=_errors(problem.pieces, held, simulated, judged),
        reconstructed=outcome.forces,
        simulated=simulated,
        accepted=outcome.accepted,
        note=outcome.note,
        steps=outcome.steps,
        seconds=seconds,
        history=outcome.history,
    )


def _simulated(problem: Problem, outcome: Outcome) -> tuple[Array, ...]:
    """The law's own force [N] (N,) of each piece, under the condition of its log."""
    point, delays, effects = _resolved(problem, outcome)
    pieces = (replace(p, condition=problem.condition(outcome.unknowns, i)) for i, p in enumerate(problem.pieces))
    return tuple(predict_piece(p, point, delays, effects=effects).force for p in pieces)


def _resolved(
    problem: Problem, outcome: Outcome
) -> tuple[Coordinates, tuple[float, float], tuple[ActiveEffect, ...]]:
    point = problem.space.to_coordinates(outcome.unknowns[:COORDINATE_COUNT])
    whole = problem.whole(outcome.unknowns)
    return point, problem.further_delays(whole), problem.active_effects(whole)


def _errors(
    pieces: Sequence[Piece], held: Sequence[Array], forces: Sequence[Array], blind: Sequence[Array]
) -> Errors:
    """Errors of the final forces on training samples, and of the blind ones on validation samples."""
    train, validation = [], []
    for piece, aside, final, unseen in zip(pieces, held, forces, blind, strict=True):
        train.append((final - piece.force)[np.isfinite(final) & (piece.train > 0) & (aside == 0)])
        validation.append((unseen - piece.force)[np.isfinite(unseen) & (aside > 0)])
    joined = np.concatenate(validation)
    return Errors(rmse(np.concatenate(train)), rmse(joined) if len(joined) else None)

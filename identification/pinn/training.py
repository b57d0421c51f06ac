"""Training of a network on a problem, and its two errors: of the network's own force and of the simulated law."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from identification.arrays import Array
from identification.damper import Coordinates
from identification.errors import IdentificationError
from identification.fitting import COORDINATE_COUNT, Piece, Problem, compute_rmse, predict_piece
from identification.logs import Stretch
from identification.pinn.common import (
    DenseSettings,
    ElementSettings,
    ForceErrors,
    PaperSettings,
    PinnResult,
    PinnSettings,
    TrainingMonitor,
    TrainingOutcome,
    compute_effect_deviations,
    is_supported,
    make_validation_masks,
)
from identification.pinn.elements import train_elements
from identification.simulate import ActiveEffect
from identification.threads import use_one_thread

_MAX_BATCH_ACCELERATOR, _MAX_BATCH_CPU = 16, 1
"""Largest number of dampers in a batch, unless the settings have another.

On an accelerator, the Jacobian of a damper and its intermediate arrays take some 0.3 GB. A processor is busy with
one damper, and the arrays of several would not fit its caches.
"""


def train(
    problem: Problem,
    settings: PinnSettings,
    monitor: TrainingMonitor | None = None,
    stretches: Sequence[Stretch] | None = None,
) -> PinnResult:
    """Train a network and evaluate its result.

    The training uses no simulation. One simulation afterwards evaluates the result.

    Args:
        problem: recordings, noise and bounds.
        settings: settings of the network.
        monitor: progress, stop requests and budget.
        stretches: recordings behind the pieces, to estimate their motion again; None to keep the motion.

    Raises:
        TrainingStopped: the training ended before it had a result.
        IdentificationError: the network does not support an effect or a per-log parameter of the problem.
    """
    if reason := describe_incompatibility(problem, settings):
        raise IdentificationError(reason)
    if isinstance(settings, DenseSettings):
        return train_batch([problem], settings, monitor)[0]
    monitor = monitor or TrainingMonitor()
    validation = make_validation_masks(problem.pieces, settings.validation_share, settings.seed)
    with use_one_thread():
        outcome, blind = _select_training(settings)(problem, validation, settings, monitor, stretches)
    seconds = monitor.seconds
    return _evaluate_outcome(problem, validation, settings.network, outcome, blind, seconds)


def train_batch(
    problems: Sequence[Problem], settings: DenseSettings, monitor: TrainingMonitor | None = None
) -> list[PinnResult]:
    """Train the dense network on several dampers of one size, in the same steps.

    Each damper has its own network, parameters and evaluation. Up to rounding, its result is that of a training
    alone. Its processor time is its share of the batch's.

    Args:
        problems: problem of each damper.
        settings: settings of the network.
        monitor: progress, stop requests and budget of the batch.

    Raises:
        TrainingStopped: the training ended before it had a result.
    """
    import torch

    from identification.pinn.dense import train_dense

    torch.set_num_threads(1)
    monitor = monitor or TrainingMonitor()
    validation = [make_validation_masks(p.pieces, settings.validation_share, settings.seed) for p in problems]
    with use_one_thread():
        outcomes = train_dense(problems, validation, settings, monitor)
    seconds = monitor.seconds / len(problems)
    return [
        _evaluate_outcome(problem, masks, settings.network, outcome, blind, seconds)
        for problem, masks, (outcome, blind) in zip(problems, validation, outcomes, strict=True)
    ]


def group_batches(problems: Sequence[Problem], settings: DenseSettings) -> list[list[int]]:
    """Return the indices of the dampers that are trained together, batch by batch.

    They have the same number of stretches and of samples per step; longer recordings do not matter. On a processor
    each damper is a batch.
    """
    from identification.pinn.dense import compute_batch_size

    groups = dict[tuple[int, int], list[int]]()
    for number, problem in enumerate(problems):
        groups.setdefault(compute_batch_size(problem, settings), []).append(number)
    size = settings.max_dampers or (_MAX_BATCH_CPU if settings.device == "cpu" else _MAX_BATCH_ACCELERATOR)
    return [group[k : k + size] for group in groups.values() for k in range(0, len(group), size)]


def describe_incompatibility(problem: Problem, settings: PinnSettings) -> str:
    """Return why a network does not support a problem, as text for a person; empty if it does."""
    if not isinstance(settings, ElementSettings):
        reason = f"the {settings.network} network learns the law alone, of one damper in one condition"
        return f"{reason}; use --preset elements" if problem.effects or problem.per_log else ""
    unsupported = [f"{c.name} ({c.form_name})" for c in problem.effects if not is_supported(c.form)]
    if unsupported:
        return (
            f"{unsupported[0]} makes the damper's own motion, or the memory of the force channel, a state that "
            "the network does not have; fit it by simulation"
        )
    return ""


def _select_training(
    settings: ElementSettings | PaperSettings,
) -> Callable[..., tuple[TrainingOutcome, TrainingOutcome]]:
    """Return the training of a kind of network; torch is imported only for the network of the paper."""
    if isinstance(settings, ElementSettings):
        return train_elements
    import torch

    from identification.pinn.paper import train_paper

    torch.set_num_threads(1)
    return train_paper


def _evaluate_outcome(
    problem: Problem,
    validation: Sequence[Array],
    network: str,
    outcome: TrainingOutcome,
    blind: TrainingOutcome,
    seconds: float,
) -> PinnResult:
    """Return an outcome with its errors.

    Args:
        problem: problem that was learned.
        validation: validation mask (N,) of each piece.
        network: name of the network.
        outcome: outcome at the end of the training.
        blind: outcome before the validation blocks were fitted.
        seconds: processor time [s].
    """
    # y(0) is a parameter as well: it must not be fitted to the validation blocks.
    split = problem.exclude_samples(validation)
    coordinates, delays, effects = _resolve_outcome(problem, outcome)
    simulated, simulated_blind = _simulate_forces(split, outcome), _simulate_forces(split, blind)
    coordinate_covariance, effect_deviations = None, np.full(problem.layout.effect_count, np.nan)
    if outcome.covariance is not None:
        D = problem.space.differentiate(outcome.unknowns[:COORDINATE_COUNT])
        coordinate_covariance = D @ outcome.covariance[:COORDINATE_COUNT, :COORDINATE_COUNT] @ D.T
        effect_deviations = compute_effect_deviations(problem, outcome.unknowns, outcome.covariance)
    return PinnResult(
        network=network,
        coordinates=coordinates,
        unknowns=outcome.unknowns,
        covariance=outcome.covariance,
        coordinate_covariance=coordinate_covariance,
        delays=delays,
        effects=effects,
        effect_deviations=effect_deviations,
        reconstruction=_compute_errors(problem.pieces, validation, outcome.forces, blind.forces),
        simulation=_compute_errors(problem.pieces, validation, simulated, simulated_blind),
        reconstructed_force=outcome.forces,
        simulated_force=simulated,
        accepted=outcome.accepted,
        note=outcome.note,
        steps=outcome.steps,
        seconds=seconds,
        history=outcome.history,
    )


def _simulate_forces(problem: Problem, outcome: TrainingOutcome) -> tuple[Array, ...]:
    """Return the simulated force [N] (N,) of each piece, with the correction of its log."""
    coordinates, delays, effects = _resolve_outcome(problem, outcome)
    pieces = (
        replace(p, correction=problem.find_correction(outcome.unknowns, i)) for i, p in enumerate(problem.pieces)
    )
    return tuple(predict_piece(p, coordinates, delays, effects=effects).force for p in pieces)


def _resolve_outcome(
    problem: Problem, outcome: TrainingOutcome
) -> tuple[Coordinates, tuple[float, float], tuple[ActiveEffect, ...]]:
    """Return coordinates, residual delays [s] and effects of an outcome."""
    coordinates = problem.space.to_coordinates(outcome.unknowns[:COORDINATE_COUNT])
    unknowns = problem.expand_shared(outcome.unknowns)
    return coordinates, problem.compute_residual_delays(unknowns), problem.make_active_effects(unknowns)


def _compute_errors(
    pieces: Sequence[Piece], validation: Sequence[Array], final: Sequence[Array], blind: Sequence[Array]
) -> ForceErrors:
    """Return the errors of final forces on training samples, and of blind ones on validation samples."""
    train_errors, validation_errors = [], []
    for piece, mask, final_force, blind_force in zip(pieces, validation, final, blind, strict=True):
        is_trained = np.isfinite(final_force) & (piece.train > 0) & (mask == 0)
        train_errors.append((final_force - piece.force)[is_trained])
        validation_errors.append((blind_force - piece.force)[np.isfinite(blind_force) & (mask > 0)])
    joined = np.concatenate(validation_errors)
    return ForceErrors(compute_rmse(np.concatenate(train_errors)), compute_rmse(joined) if len(joined) else None)

"""Network as a stage of the fit, independent of the output-error fit.

No result of either stage enters the other. Only their results are compared. The networks are imported when the
stage runs. The network `elements` does not need torch.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

from identification.damper import Coordinates
from identification.documents import FitStage, SplitErrors
from identification.errors import IdentificationError
from identification.fitting import COORDINATE_COUNT, Budget, Minimum, Problem, predict_piece
from identification.logs import Stretch
from identification.progress import Progress
from identification.uncertainty import (
    MIN_INFORMATION,
    Agreement,
    Covariance,
    compare_estimates,
    compute_coordinate_covariance,
    find_unobservable,
    make_coordinate_estimates,
)

if TYPE_CHECKING:
    from identification.pinn.common import DenseSettings, PinnResult, PinnSettings


@dataclass(frozen=True)
class NetworkResult:
    """Result of training the network, or the reason of its failure."""

    result: "PinnResult | None"
    failure: str
    """Reason why there is no result; empty where there is one."""


def train_network(
    problem: Problem,
    stretches: Sequence[Stretch],
    preset: str,
    seed: int,
    budget: Budget,
    progress: Progress,
) -> NetworkResult:
    """Train the network of a preset.

    Args:
        problem: the problem to fit.
        stretches: recordings of its pieces.
        preset: name of a preset, or path of a settings file.
        seed: seed of all random numbers.
        budget: limit on steps or processor time.
        progress: receives every step.

    Raises:
        IdentificationError: there is no such preset, or its network needs torch, which is not installed.
    """
    from identification.pinn import describe_incompatibility, train
    from identification.pinn.common import TrainingMonitor, TrainingStopped

    settings = _read_settings(preset, seed)
    if reason := describe_incompatibility(problem, settings):
        return NetworkResult(None, reason)
    try:
        return NetworkResult(train(problem, settings, TrainingMonitor(progress, budget=budget), stretches), "")
    except TrainingStopped as stopped:
        return NetworkResult(None, str(stopped))


def train_networks(
    problems: Sequence[Problem], preset: str, seed: int, budget: Budget, progress: Progress
) -> Iterator[tuple[int, NetworkResult | None]]:
    """Train the network of a preset on many dampers, as many at once as possible.

    Args:
        problems: problems to fit, one per damper.
        preset: name of a preset, or path of a settings file.
        seed: seed of all random numbers.
        budget: limit on steps, or on processor time per damper.
        progress: receives every step.

    Yields:
        The number of a damper and its result, group by group; None for a damper that is trained alone.

    Raises:
        IdentificationError: as for one damper.
    """
    from identification.pinn.common import DenseSettings

    settings = _read_settings(preset, seed)
    if not isinstance(settings, DenseSettings):
        yield from ((k, None) for k in range(len(problems)))
        return
    from identification.pinn import group_batches

    for batch in group_batches(problems, settings):
        results = _train_batch([problems[k] for k in batch], settings, budget, progress)
        yield from zip(batch, results, strict=True)


def _train_batch(
    problems: Sequence[Problem], settings: "DenseSettings", budget: Budget, progress: Progress
) -> list[NetworkResult]:
    from identification.pinn import train_batch
    from identification.pinn.common import TrainingMonitor, TrainingStopped

    monitor = TrainingMonitor(progress, budget=budget.scale(len(problems)))
    try:
        return [NetworkResult(result, "") for result in train_batch(problems, settings, monitor)]
    except TrainingStopped as stopped:
        return [NetworkResult(None, str(stopped))] * len(problems)


def _read_settings(preset: str, seed: int) -> "PinnSettings":
    """Return the settings of a preset whose network can be trained on this machine.

    Raises:
        IdentificationError: there is no such preset, or its network needs torch, which is not installed.
    """
    from identification.pinn.common import read_settings

    settings = read_settings(preset).model_copy(update={"seed": seed})
    if settings.network != "elements" and find_spec("torch") is None:
        raise IdentificationError(
            f"the network `{settings.network}` needs torch, which is not installed; install "
            "mrbench[identification] or use --preset elements"
        )
    return settings


def make_minimum(problem: Problem, network: "PinnResult") -> tuple[Minimum, Covariance]:
    """Return the network's parameters as a minimum with its covariance, for a fit by the network alone."""
    unknowns = problem.make_start(network.coordinates)
    unknowns[problem.shared_columns] = network.unknowns
    pieces = [problem.get_piece(unknowns, i) for i in range(len(problem.pieces))]
    y0 = [predict_piece(p, network.coordinates, network.delays, effects=network.effects).y0 for p in pieces]
    unknowns[problem.layout.y0] = np.array(y0) / problem.y0_scale
    minimum = Minimum(unknowns, problem.evaluate(unknowns), network.steps, converged=network.accepted)
    covariance = np.zeros((len(unknowns), len(unknowns)))
    if network.covariance is not None:
        covariance[np.ix_(problem.shared_columns, problem.shared_columns)] = network.covariance
    observable = problem.free_mask & (np.diag(minimum.evaluation.hessian) > MIN_INFORMATION)
    interior = observable & problem.find_interior(unknowns)
    return minimum, Covariance(covariance, observable, interior, is_coloured=False)


def compare_with_network(
    network: "PinnResult", problem: Problem, minimum: Minimum, covariance: Covariance
) -> Agreement:
    """Compare the network's coordinates with those at a minimum that are observable and inside their bounds."""
    point = problem.space.to_coordinates(minimum.unknowns[problem.layout.coordinates])
    variances = np.diag(compute_coordinate_covariance(problem, minimum, covariance))
    unobservable, at_bound = find_unobservable(covariance)
    comparable = set(Coordinates._fields) - unobservable - at_bound
    return compare_estimates(
        network.coordinates, network.deviations, point, np.sqrt(np.maximum(variances, 0.0)), comparable
    )


def make_stage_entry(
    network: "PinnResult", unobservable: set[str], held_out: float | None, drive_unit: str
) -> FitStage:
    """Return the network's stage entry of a fit document.

    Args:
        network: result of the training.
        unobservable: names of the coordinates that the strokes do not determine.
        held_out: force error on held-out samples [N]; None where none are held out.
        drive_unit: V or A.
    """
    covariance = network.coordinate_covariance
    unknown = np.full((COORDINATE_COUNT, COORDINATE_COUNT), np.nan)
    estimates = make_coordinate_estimates(
        network.coordinates, unknown if covariance is None else covariance, unobservable, set(), drive_unit
    )
    simulated, reconstructed = network.simulation, network.reconstruction
    return FitStage(
        name="pinn",
        seconds=round(network.seconds, 3),
        rmse_n=simulated.train,
        iterations=network.steps,
        note=network.note,
        simulated_n=SplitErrors(train=simulated.train, validation=simulated.validation, held_out=held_out),
        reconstructed_n=SplitErrors(train=reconstructed.train, validation=reconstructed.validation, held_out=None),
        coordinates=estimates,
    )

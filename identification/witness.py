"""The network as a stage of the fit: a second witness that never sees the first.

Nothing of the refinement enters the training and nothing of the training the refinement; only their answers are
compared. The networks are loaded here and only when the stage runs; the local one needs no torch.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

from identification.agreement import Agreement, compare
from identification.damper.coordinates import Coordinates
from identification.errors import IdentificationError
from identification.prediction import predict_piece
from identification.problem import COMMON_COUNT, COORDINATE_COUNT, Y0_SCALE, Problem
from identification.recordings import Stretch
from identification.refine import Minimum
from identification.results import Errors, Stage
from identification.uncertainty import SEEN, Covariance, coordinate_covariance, coordinate_estimates, unseen

if TYPE_CHECKING:
    from identification.pinn.result import PinnResult
    from identification.pinn.settings import GlobalSettings, LocalSettings, PaperSettings

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Testimony:
    """What the network's training came to."""

    found: "PinnResult | None"
    why_not: str
    """Why nothing was found; empty where something was."""


def train_stage(
    problem: Problem,
    stretches: Sequence[Stretch],
    preset: str,
    seed: int,
    budget: float | None,
    progress: Progress,
) -> Testimony:
    """Train the network of a preset.

    Args:
        problem: what is fitted.
        stretches: the recordings behind its pieces.
        preset: name of a preset, or path of a settings file.
        seed: of everything that chance decides.
        budget: [s] of processor time; None for as long as it takes.
        progress: told of every step.

    Raises:
        IdentificationError: there is no such preset, or its network needs torch, which is not installed.
    """
    from identification.pinn.supervision import Stopped, Supervision
    from identification.pinn.train import train, why_not

    settings = _settings(preset, seed)
    if why := why_not(problem, settings):
        return Testimony(None, why)
    try:
        return Testimony(train(problem, settings, Supervision(progress, budget=budget), stretches), "")
    except Stopped as stopped:
        return Testimony(None, str(stopped))


def train_together(
    problems: Sequence[Problem], preset: str, seed: int, budget: float | None, progress: Progress
) -> Iterator[tuple[int, Testimony | None]]:
    """Train the network of a preset on many dampers, as many at once as go together.

    Args:
        problems: what is fitted, one a damper.
        preset: name of a preset, or path of a settings file.
        seed: of everything that chance decides.
        budget: [s] of processor time for each damper; None for as long as it takes.
        progress: told of every step.

    Yields:
        The number of a damper and its answer, batch by batch; None for one that is to be trained alone.

    Raises:
        IdentificationError: as for one damper.
    """
    from identification.pinn.settings import GlobalSettings

    settings = _settings(preset, seed)
    if not isinstance(settings, GlobalSettings):
        yield from ((k, None) for k in range(len(problems)))
        return
    from identification.pinn.train import batches

    for batch in batches(problems, settings):
        some = [problems[k] for k in batch]
        yield from zip(batch, _batch(some, settings, budget, progress), strict=True)


def _batch(
    problems: Sequence[Problem], settings: "GlobalSettings", budget: float | None, progress: Progress
) -> list[Testimony]:
    from identification.pinn.supervision import Stopped, Supervision
    from identification.pinn.train import train_batch

    supervision = Supervision(progress, budget=None if budget is None else budget * len(problems))
    try:
        return [Testimony(one, "") for one in train_batch(problems, settings, supervision)]
    except Stopped as stopped:
        return [Testimony(None, str(stopped))] * len(problems)


def _settings(preset: str, seed: int) -> "LocalSettings | GlobalSettings | PaperSettings":
    """Settings of a preset, if its network can be trained here."""
    from identification.pinn.settings import read_settings

    settings = read_settings(preset).model_copy(update={"seed": seed})
    if settings.network != "local" and find_spec("torch") is None:
        raise IdentificationError(
            f"the {settings.network} network needs torch, which is missing; install mrbench[identification] or "
            "say --preset local"
        )
    return settings


def as_minimum(problem: Problem, found: "PinnResult") -> tuple[Minimum, Covariance]:
    """The network's parameters in the form of a descent's end, for a fit that rests on the network alone."""
    unknowns = problem.start(found.coordinates)
    unknowns[problem.shared] = found.unknowns
    pieces = [problem.piece(unknowns, i) for i in range(len(problem.pieces))]
    y0 = [predict_piece(p, found.coordinates, found.delays, effects=found.effects).y0 for p in pieces]
    unknowns[COMMON_COUNT : COMMON_COUNT + len(y0)] = np.array(y0) / Y0_SCALE
    minimum = Minimum(unknowns, problem.evaluate(unknowns), found.steps, converged=found.accepted)
    spread = np.zeros((len(unknowns), len(unknowns)))
    if found.covariance is not None:
        spread[np.ix_(problem.shared, problem.shared)] = found.covariance
    seen = problem.free & (np.diag(minimum.evaluation.hessian) > SEEN)
    return minimum, Covariance(spread, seen, seen & problem.inside(unknowns), coloured=False)


def agreement_with(network: "PinnResult", problem: Problem, minimum: Minimum, found: Covariance) -> Agreement:
    """How far the network's coordinates lie from those at a descent's end, where the strokes show them at all."""
    point = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    spread = np.diag(coordinate_covariance(problem, minimum, found))
    hidden, at_bound = unseen(found)
    known = set(Coordinates._fields) - hidden - at_bound
    return compare(network.coordinates, network.deviations, point, np.sqrt(np.maximum(spread, 0.0)), known)


def stage_entry(found: "PinnResult", hidden: set[str], held_out: float | None, unit: str) -> Stage:
    """The stage's line in the fit document, with its own coordinates."""
    spread = found.coordinate_covariance
    unknown = np.full((COORDINATE_COUNT, COORDINATE_COUNT), np.nan)
    estimates = coordinate_estimates(found.coordinates, unknown if spread is None else spread, hidden, set(), unit)
    simulated, own = found.simulation, found.reconstruction
    return Stage(
        name="pinn",
        seconds=round(found.seconds, 3),
        rmse_n=simulated.train,
        iterations=found.steps,
        note=found.note,
        simulated_n=Errors(train=simulated.train, validation=simulated.validation, held_out=held_out),
        reconstructed_n=Errors(train=own.train, validation=own.validation, held_out=None),
        coordinates=estimates,
    )

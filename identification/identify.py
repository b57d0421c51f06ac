"""The fit of one or several logs: assemble, refine, say how sure."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import version

import numpy as np

from identification.arrays import Array
from identification.assemble import Assembled, HoldOut, assemble
from identification.damper.coordinates import Coordinates
from identification.motion_noise import motion_scatter, with_motion
from identification.prediction import normalised, per_drive, predict_piece, rmse
from identification.problem import COORDINATE_COUNT, Problem
from identification.recordings import Recording, Stretch
from identification.refine import Minimum, Settings, refine
from identification.results import Errors, Fit, NoiseFloor, Nuisances, Provenance, Stage
from identification.search_space import SearchSpace
from identification.uncertainty import (
    Covariance,
    coordinate_covariance,
    coordinate_estimates,
    covariance,
    delay_estimate,
    parameter_estimates,
    strong_correlations,
)

_MISFIT = 1.2
"""[1] force error over the floor above which the priors are weighed against the misfit, not the noise."""

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Request:
    """What is asked of a fit."""

    hold_out: HoldOut = field(default_factory=HoldOut)
    delay_prior: float | None = None
    """[s] standard deviation of the channel delays beyond what the log reports; None takes the log's clocks."""
    settings: Settings = field(default_factory=Settings)


def identify(
    recordings: Sequence[Recording], request: Request = Request(), progress: Progress = lambda what, error: None
) -> Fit:
    """Identify the damper from recordings of it.

    Args:
        recordings: one or several logs of one specimen, driven in the same way.
        request: what is held out, how well the clocks are known, how hard to try.
        progress: told what is being done and the force error so far [N].

    Raises:
        NothingToFit: too little is left to fit.
    """
    assembled = assemble(recordings, request.hold_out)
    began = time.process_time()
    problem = _problem(assembled, request)
    stretches = [s for s, p in zip(assembled.stretches, assembled.pieces, strict=True) if p.train.any()]
    minimum = refine(problem.quicker(), request.settings, progress)
    polish = replace(request.settings, restarts=0)
    scatter = None
    if _ratio(problem, minimum) > _MISFIT:
        problem = replace(problem, noise=problem.noise * _ratio(problem, minimum))
        minimum = refine(problem, polish, progress, minimum.unknowns)
    else:
        problem = _smoother_motion(problem, stretches, minimum)
        minimum = refine(problem, polish, progress, minimum.unknowns)
        scatter = motion_scatter(problem, stretches, minimum, request.settings.seed)
    found = covariance(problem, minimum, scatter)
    return _document(assembled, request, problem, minimum, found, time.process_time() - began)


def _smoother_motion(problem: Problem, stretches: Sequence[Stretch], minimum: Minimum) -> Problem:
    """The problem with every motion estimated again, the actuator giving way under the fitted force.

    The recorded force would bring its noise into the motion, and what is common to both biases the fit.
    """
    forces = problem.simulate(minimum.unknowns)
    pieces = [
        with_motion(piece, replace(stretch, force=force))
        for piece, stretch, force in zip(problem.pieces, stretches, forces, strict=True)
    ]
    return replace(problem, pieces=tuple(pieces))


def _problem(assembled: Assembled, request: Request) -> Problem:
    fitted = [p.stroke.drive[p.train > 0] for p in assembled.pieces]
    drives = np.concatenate(fitted)
    prior = assembled.delay_prior if request.delay_prior is None else request.delay_prior
    pieces = tuple(p for p in assembled.pieces if p.train.any())
    return Problem(
        pieces, SearchSpace(float(drives.min()), float(drives.max())), assembled.floor.noise, max(prior, 1e-9)
    )


def _ratio(problem: Problem, minimum: Minimum) -> float:
    """Force error over the noise that the problem was weighed with."""
    return float(np.sqrt(minimum.evaluation.cost / problem.samples))


def _document(
    assembled: Assembled, request: Request, problem: Problem, minimum: Minimum, found: Covariance, seconds: float
) -> Fit:
    spread = coordinate_covariance(problem, minimum, found)
    point = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    unit = assembled.drive_unit
    hidden, at_bound = _unseen(problem, found.known)
    coordinates = coordinate_estimates(point, spread, hidden, at_bound, unit)
    delays = minimum.unknowns[COORDINATE_COUNT : COORDINATE_COUNT + 2] * problem.delay_prior
    errors = _errors(assembled, point, (float(delays[0]), float(delays[1])))
    train = _split(assembled, errors, held=False)
    held = _split(assembled, errors, held=True)
    sd = np.sqrt(np.diag(found.unknowns)[COORDINATE_COUNT : COORDINATE_COUNT + 2]) * problem.delay_prior
    floor = assembled.floor
    return Fit(
        specimen=assembled.recordings[0].metadata["run"].get("specimen", ""),
        drive_kind=assembled.recordings[0].drive_kind,
        drive_unit=unit,
        drive_range=(problem.space.lowest_drive, problem.space.highest_drive),
        parameters=parameter_estimates(point, spread, coordinates, unit),
        coordinates=coordinates,
        nuisances=Nuisances(
            y0={
                p.name: float(minimum.unknowns[-len(problem.pieces) + i]) * 1e-3
                for i, p in enumerate(problem.pieces)
            },
            force_delay=delay_estimate(float(delays[0]), float(sd[0]), problem.delay_prior),
            drive_delay=delay_estimate(float(delays[1]), float(sd[1]), problem.delay_prior),
        ),
        noise_floor_n=floor.noise,
        floor=NoiseFloor(cycle_to_cycle=floor.cycle_to_cycle, high_frequency=floor.high_frequency, how=floor.how),
        rmse_n=Errors(train=rmse(train[0]), validation=None, held_out=rmse(held[0]) if len(held[0]) else None),
        nrmse=Errors(
            train=normalised(*train), validation=None, held_out=normalised(*held) if len(held[0]) else None
        ),
        per_drive=per_drive(
            [p.stroke.drive for p in assembled.pieces], errors, [p.force for p in assembled.pieces], unit
        ),
        stages=[
            Stage(name="refine", seconds=round(seconds, 3), rmse_n=rmse(train[0]), iterations=minimum.iterations)
        ],
        agreement=None,
        result=_result(minimum, problem, found.coloured, rmse(train[0]) / floor.noise),
        correlations=strong_correlations(spread),
        provenance=Provenance(
            logs={r.path.name: r.sha256 for r in assembled.recordings},
            version=version("mrbench"),
            seed=request.settings.seed,
            settings={
                "stages": "refine",
                "hold_out": ",".join(request.hold_out.patterns) or None,
                "hold_out_after": request.hold_out.after,
                "delay_prior_s": problem.delay_prior,
                "restarts": request.settings.restarts,
            },
        ),
    )


def _unseen(problem: Problem, known: Array) -> tuple[set[str], set[str]]:
    """Coordinates that these strokes cannot show, and those that stand at a bound."""
    names = np.array(Coordinates._fields)
    free = problem.space.free
    return set(names[~free]), set(names[free & (known[:COORDINATE_COUNT] == 0)])


def _errors(assembled: Assembled, point: Coordinates, delays: tuple[float, float]) -> list[Array]:
    """Simulated minus recorded force [N] of every stretch, y(0) from its fitted samples, or all if none is."""
    return [predict_piece(p, point, delays).force - p.force for p in assembled.pieces]


def _split(assembled: Assembled, errors: Sequence[Array], *, held: bool) -> tuple[Array, Array]:
    """Errors and recorded forces [N] of all samples fitted, or of all held out."""
    chosen = [
        out & s.measured if held else p.train > 0
        for p, out, s in zip(assembled.pieces, assembled.held_out, assembled.stretches, strict=True)
    ]
    return (
        np.concatenate([e[c] for e, c in zip(errors, chosen, strict=True)]),
        np.concatenate([p.force[c] for p, c in zip(assembled.pieces, chosen, strict=True)]),
    )


def _result(minimum: Minimum, problem: Problem, coloured: bool, ratio: float) -> str:
    """One line on how the fit ended."""
    if not minimum.converged:
        return f"not converged: stopped after {minimum.iterations} steps; raise the budget or hold less out"
    if ratio > _MISFIT:
        return f"converged; the law leaves {ratio:.3g} times the noise floor: something real is missing from it"
    return "converged"

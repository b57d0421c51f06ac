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
from identification.problem import COORDINATE_COUNT, Piece, Problem
from identification.recordings import Recording, Stretch
from identification.refine import Minimum, Settings, refine
from identification.results import Delay, Errors, Fit, NoiseFloor, Nuisances, Provenance, Stage
from identification.search_space import SearchSpace
from identification.start import sliding_damping
from identification.uncertainty import (
    Covariance,
    coordinate_covariance,
    coordinate_estimates,
    covariance,
    delay_estimate,
    parameter_estimates,
    strong_correlations,
)

_GROWTH = 3.0
"""[1] largest exponent by which the inner displacement may run away within a stretch."""
_MORE_THAN_PRIOR = 1.01
"""[1] information on a delay, in units of its prior's, above which the recording adds to the prior."""
_OVERSHOOT = 0.005
"""[1] part of the samples at each end of the drive's range that may be overshoots."""
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
    problem = fit_problem(assembled, request.delay_prior)
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


def fit_problem(assembled: Assembled, delay_prior: float | None = None) -> Problem:
    """What a fit of some recordings minimises.

    Args:
        assembled: the recordings.
        delay_prior: deviation of the channel delays beyond what the log reports [s]; None takes its clocks.
    """
    fitted = [p.stroke.drive[p.train > 0] for p in assembled.pieces]
    drives = np.concatenate(fitted)
    prior = assembled.delay_prior if delay_prior is None else delay_prior
    pieces = tuple(p for p in assembled.pieces if p.train.any())
    space = SearchSpace(*_range(drives), lowest_k0=_lowest_k0(pieces))
    return Problem(pieces, space, assembled.floor.noise, max(prior, 1e-9))


def _lowest_k0(pieces: Sequence[Piece]) -> float:
    """Stiffness [N/m] at which the inner displacement would grow by e^3 in the longest stretch.

    It moves with the time constant (c0 + c1) / k0. A more negative k0 fits a drift and simulates nonsense.
    """
    longest = max(len(p.force) / p.stroke.rate for p in pieces)
    return -_GROWTH * sliding_damping(pieces) / longest


def _range(drives: Array) -> tuple[float, float]:
    """Lowest and highest drive at which a damper must be one; short overshoots of a driver do not count."""
    low, high = np.quantile(drives, [_OVERSHOOT, 1.0 - _OVERSHOOT])
    return float(low), float(high)


def _ratio(problem: Problem, minimum: Minimum) -> float:
    """Force error over the noise that the problem was weighed with."""
    return float(np.sqrt(minimum.evaluation.cost / problem.samples))


def _document(
    assembled: Assembled, request: Request, problem: Problem, minimum: Minimum, found: Covariance, seconds: float
) -> Fit:
    spread = coordinate_covariance(problem, minimum, found)
    point = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    unit = assembled.drive_unit
    hidden, at_bound = _unseen(found)
    coordinates = coordinate_estimates(point, spread, hidden, at_bound, unit)
    nuisances = _nuisances(problem, minimum, found)
    errors = _errors(assembled, point, (nuisances.force_delay.value, nuisances.drive_delay.value))
    train = _split(assembled, errors, held=False)
    held = _split(assembled, errors, held=True)
    floor = assembled.floor
    return Fit(
        specimen=assembled.recordings[0].metadata["run"].get("specimen", ""),
        drive_kind=assembled.recordings[0].drive_kind,
        drive_unit=unit,
        drive_range=(problem.space.lowest_drive, problem.space.highest_drive),
        parameters=parameter_estimates(point, spread, coordinates, unit),
        coordinates=coordinates,
        nuisances=nuisances,
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
        result=_result(minimum, rmse(train[0]) / floor.noise, nuisances.force_delay),
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


def _nuisances(problem: Problem, minimum: Minimum, found: Covariance) -> Nuisances:
    delays = slice(COORDINATE_COUNT, COORDINATE_COUNT + 2)
    prior = problem.delay_prior
    values = minimum.unknowns[delays] * prior
    sd = np.sqrt(np.diag(found.unknowns)[delays]) * prior
    seen = np.diag(minimum.evaluation.hessian)[delays] > _MORE_THAN_PRIOR
    force, drive = (
        delay_estimate(float(v), float(s), prior, seen=bool(by_data))
        for v, s, by_data in zip(values, sd, seen, strict=True)
    )
    starts = {p.name: problem.setting(minimum.unknowns, i).y0 for i, p in enumerate(problem.pieces)}
    return Nuisances(y0=starts, force_delay=force, drive_delay=drive)


def _unseen(found: Covariance) -> tuple[set[str], set[str]]:
    """Coordinates that these strokes cannot show, and those that stand at a bound."""
    names = np.array(Coordinates._fields)
    seen, inside = found.seen[:COORDINATE_COUNT], found.inside[:COORDINATE_COUNT]
    return set(names[~seen]), set(names[seen & ~inside])


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


def _result(minimum: Minimum, ratio: float, delay: Delay) -> str:
    """How the fit ended, in a line."""
    if not minimum.converged:
        return f"not converged: stopped after {minimum.iterations} steps; raise the budget or hold less out"
    words = ["converged"]
    if ratio > _MISFIT:
        words.append(f"the law leaves {ratio:.3g} times the noise floor: something real is missing from it")
    if delay.outside_prior:
        side = "behind" if delay.value > 0 else "ahead of"
        words.append(
            f"the force stands {1e3 * abs(delay.value):.2g} ms {side} the displacement, more than their clocks "
            f"explain ({1e3 * delay.prior_sd:.2g} ms): a filter, or phase that the law lacks"
        )
    return "; ".join(words)

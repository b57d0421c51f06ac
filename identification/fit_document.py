"""Where a fit ended, and the document that says it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.agreement import Agreement
from identification.arrays import Array
from identification.assemble import Assembled
from identification.condition import OWN
from identification.damper.coordinates import Coordinates
from identification.prediction import normalised, per_drive, predict_piece, rmse
from identification.problem import COMMON_COUNT, COORDINATE_COUNT, Problem
from identification.refine import Minimum
from identification.results import Delay, Errors, Estimate, Fit, NoiseFloor, Nuisances, Provenance, Stage
from identification.uncertainty import (
    Covariance,
    coordinate_covariance,
    coordinate_estimates,
    delay_estimate,
    own_estimate,
    parameter_estimates,
    strong_correlations,
    unseen,
)

MISFIT = 1.2
"""[1] force error over the floor above which the priors are weighed against the misfit, not the noise."""
_MORE_THAN_PRIOR = 1.01
"""[1] information on a delay, in units of its prior's, above which the recording adds to the prior."""


@dataclass(frozen=True)
class Ending:
    """Where a fit stands: the problem as it was weighed, its end, how sure it is, and the stages on the way."""

    problem: Problem
    minimum: Minimum
    covariance: Covariance
    stages: tuple[Stage, ...]
    agreement: Agreement | None = None
    said: str | None = None
    """Of the agreement, in words."""
    why_not: str = ""
    """Why it is no answer; empty where the descent itself says it."""
    notes: tuple[str, ...] = ()
    """What a person should know of how it ended."""


def fit_document(assembled: Assembled, end: Ending, provenance: Provenance) -> Fit:
    """The fit as a document."""
    problem, minimum, found = end.problem, end.minimum, end.covariance
    spread = coordinate_covariance(problem, minimum, found)
    point = problem.space.to_coordinates(minimum.unknowns[:COORDINATE_COUNT])
    unit = assembled.drive_unit
    hidden, at_bound = unseen(found)
    coordinates = coordinate_estimates(point, spread, hidden, at_bound, unit)
    nuisances = _nuisances(problem, minimum, found)
    each_log = _each_log(problem, minimum, found, [r.path.name for r in assembled.recordings])
    errors = simulated_errors(assembled, point, (nuisances.force_delay.value, nuisances.drive_delay.value))
    train = of_samples(assembled, errors, held=False)
    held = of_samples(assembled, errors, held=True)
    floor = assembled.floor
    return Fit(
        specimen=assembled.recordings[0].metadata["run"].get("specimen", ""),
        drive_kind=assembled.recordings[0].drive_kind,
        drive_unit=unit,
        drive_range=(problem.space.lowest_drive, problem.space.highest_drive),
        parameters=parameter_estimates(point, spread, coordinates, unit),
        coordinates=coordinates,
        nuisances=nuisances.model_copy(update={"each_log": each_log}),
        noise_floor_n=floor.noise,
        floor=NoiseFloor(cycle_to_cycle=floor.cycle_to_cycle, high_frequency=floor.high_frequency, how=floor.how),
        rmse_n=Errors(train=rmse(train[0]), validation=None, held_out=rmse(held[0]) if len(held[0]) else None),
        nrmse=Errors(
            train=normalised(*train), validation=None, held_out=normalised(*held) if len(held[0]) else None
        ),
        per_drive=per_drive(
            [p.stroke.drive for p in assembled.pieces], errors, [p.force for p in assembled.pieces], unit
        ),
        stages=list(end.stages),
        agreement=end.said,
        agreement_deviations=end.agreement.deviations if end.agreement else None,
        result=_result(end, rmse(train[0]) / floor.noise, nuisances.force_delay),
        correlations=strong_correlations(spread),
        covariance=spread.tolist(),
        provenance=provenance,
    )


def _nuisances(problem: Problem, minimum: Minimum, found: Covariance) -> Nuisances:
    delays = slice(COORDINATE_COUNT, COMMON_COUNT)
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


def _each_log(
    problem: Problem, minimum: Minimum, found: Covariance, names: Sequence[str]
) -> dict[str, dict[str, Estimate]]:
    """What each log behind the first has of its own, by the log's name."""
    sd = np.sqrt(np.maximum(np.diag(found.unknowns), 0.0))
    # One iterator for all logs, and second in zip: no place is taken where a log's names have ended.
    places = iter(range(problem.first_own, problem.first_own + problem.own_count))
    return {
        name: {
            own: own_estimate(OWN[own], float(minimum.unknowns[at]), float(sd[at]))
            for own, at in zip(problem.own, places, strict=False)
        }
        for name in (names[1:] if problem.own else ())
    }


def simulated_errors(assembled: Assembled, point: Coordinates, delays: tuple[float, float]) -> list[Array]:
    """Simulated minus recorded force [N] of every stretch, y(0) from its fitted samples, or all if none is."""
    return [predict_piece(p, point, delays).force - p.force for p in assembled.pieces]


def of_samples(assembled: Assembled, errors: Sequence[Array], *, held: bool) -> tuple[Array, Array]:
    """Errors and recorded forces [N] of all samples fitted, or of all held out."""
    chosen = [
        out & s.counts if held else p.train > 0
        for p, out, s in zip(assembled.pieces, assembled.held_out, assembled.stretches, strict=True)
    ]
    return (
        np.concatenate([e[c] for e, c in zip(errors, chosen, strict=True)]),
        np.concatenate([p.force[c] for p, c in zip(assembled.pieces, chosen, strict=True)]),
    )


def _result(end: Ending, ratio: float, delay: Delay) -> str:
    """How the fit ended, in a line."""
    if end.why_not:
        return f"not converged: {end.why_not}"
    if not end.minimum.converged:
        return f"not converged: stopped after {end.minimum.iterations} steps; raise the budget or hold less out"
    words = ["converged"]
    if ratio > MISFIT:
        words.append(f"the law leaves {ratio:.3g} times the noise floor: something real is missing from it")
    if delay.outside_prior:
        side = "behind" if delay.value > 0 else "ahead of"
        words.append(
            f"the force stands {1e3 * abs(delay.value):.2g} ms {side} the displacement, more than their clocks "
            f"explain ({1e3 * delay.prior_sd:.2g} ms): a filter, or phase that the law lacks"
        )
    return "; ".join(words)

"""Result of a fit, and the document made from it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identification.arrays import Array
from identification.damper import Coordinates
from identification.documents import Delay, Estimate, Fit, FitStage, NoiseFloor, Nuisances, Provenance, SplitErrors
from identification.fitting import (
    PER_LOG_PARAMETERS,
    Dataset,
    Minimum,
    Problem,
    compute_drive_errors,
    compute_nrmse,
    compute_rmse,
    predict_piece,
)
from identification.noise import NoiseFloorEstimate
from identification.uncertainty import (
    Agreement,
    Covariance,
    compute_coordinate_covariance,
    find_strong_correlations,
    find_unobservable,
    make_coordinate_estimates,
    make_delay_estimate,
    make_parameter_estimates,
    make_per_log_estimate,
)

MISFIT_RATIO = 1.2
"""Threshold on the force error over the noise floor [1]: above it, the problem is weighted with the misfit."""
_MIN_INFORMATION = 1.01
"""Threshold on the information on a delay over that of its prior [1]: above it, the recording contributes."""


@dataclass(frozen=True)
class FitResult:
    """Result of a fit: the weighted problem, its minimum, the covariance and the stages."""

    problem: Problem
    minimum: Minimum
    covariance: Covariance
    stages: tuple[FitStage, ...]
    agreement: Agreement | None = None
    agreement_note: str | None = None
    """Agreement of the stages as text for a person."""
    failure: str = ""
    """Reason why the result is not accepted; empty where the minimum itself states it."""
    notes: tuple[str, ...] = ()
    """Notes for a person."""
    errors: tuple[Array, ...] | None = None
    """Simulated less recorded force (N,) [N] of each stretch at the minimum; None if not computed yet."""


def make_fit_document(dataset: Dataset, result: FitResult, provenance: Provenance) -> Fit:
    """Return the fit as a document."""
    problem, minimum = result.problem, result.minimum
    covariance = compute_coordinate_covariance(problem, minimum, result.covariance)
    point = problem.space.to_coordinates(minimum.unknowns[problem.layout.coordinates])
    unit = dataset.drive_unit
    unobservable, at_bound = find_unobservable(result.covariance)
    coordinates = make_coordinate_estimates(point, covariance, unobservable, at_bound, unit)
    nuisances = _make_nuisances(problem, minimum, result.covariance)
    per_log = _make_per_log(problem, minimum, result.covariance, [r.path.name for r in dataset.recordings])
    delays = (nuisances.force_delay.value, nuisances.drive_delay.value)
    errors = result.errors or compute_force_errors(dataset, point, delays)
    train = select_samples(dataset, errors, held_out=False)
    held_out = select_samples(dataset, errors, held_out=True)
    floor = dataset.floor
    return Fit(
        specimen=dataset.recordings[0].metadata["run"].get("specimen", ""),
        drive_kind=dataset.recordings[0].drive_kind,
        drive_unit=unit,
        drive_range=(problem.space.lowest_drive, problem.space.highest_drive),
        parameters=make_parameter_estimates(point, covariance, coordinates, unit),
        coordinates=coordinates,
        nuisances=nuisances.model_copy(update={"per_log": per_log}),
        noise_floor_n=floor.noise,
        floor=make_noise_floor(floor, compute_rmse(train[0])),
        rmse_n=SplitErrors(
            train=compute_rmse(train[0]),
            validation=None,
            held_out=compute_rmse(held_out[0]) if len(held_out[0]) else None,
        ),
        nrmse=SplitErrors(
            train=compute_nrmse(*train),
            validation=None,
            held_out=compute_nrmse(*held_out) if len(held_out[0]) else None,
        ),
        per_drive=compute_drive_errors(
            [p.excitation.drive for p in dataset.pieces], errors, [p.force for p in dataset.pieces], unit
        ),
        stages=list(result.stages),
        agreement=result.agreement_note,
        agreement_deviations=result.agreement.deviations if result.agreement else None,
        result=_describe_result(result, compute_rmse(train[0]) / floor.noise, nuisances.force_delay),
        correlations=find_strong_correlations(covariance),
        covariance=covariance.tolist(),
        provenance=provenance,
    )


def make_noise_floor(estimate: NoiseFloorEstimate, error: float) -> NoiseFloor:
    """Return the noise floor as a part of a document; ``error`` is that of the fit [N]."""
    return NoiseFloor(
        cycle_to_cycle=estimate.cycle_to_cycle,
        high_frequency=estimate.high_frequency,
        basis=estimate.basis,
        ci95=estimate.get_interval(error),
    )


def _make_nuisances(problem: Problem, minimum: Minimum, covariance: Covariance) -> Nuisances:
    delays, prior = problem.layout.delays, problem.delay_prior
    values = minimum.unknowns[delays] * prior
    sd = np.sqrt(np.diag(covariance.unknowns)[delays]) * prior
    observable = np.diag(minimum.evaluation.hessian)[delays] > _MIN_INFORMATION
    force, drive = (
        make_delay_estimate(float(v), float(s), prior, observable=bool(o))
        for v, s, o in zip(values, sd, observable, strict=True)
    )
    starts = {p.name: problem.make_model(minimum.unknowns, i).y0 for i, p in enumerate(problem.pieces)}
    return Nuisances(y0=starts, force_delay=force, drive_delay=drive)


def _make_per_log(
    problem: Problem, minimum: Minimum, covariance: Covariance, names: Sequence[str]
) -> dict[str, dict[str, Estimate]]:
    """Return the per-log parameters of each log after the first, by the log's name."""
    sd = np.sqrt(np.maximum(np.diag(covariance.unknowns), 0.0))
    # One iterator for all logs. It is second in zip, so that no column is consumed after a log's last parameter.
    columns = iter(range(problem.layout.size)[problem.layout.per_log])
    return {
        name: {
            parameter: make_per_log_estimate(
                PER_LOG_PARAMETERS[parameter], float(minimum.unknowns[at]), float(sd[at])
            )
            for parameter, at in zip(problem.per_log, columns, strict=False)
        }
        for name in (names[1:] if problem.per_log else ())
    }


def compute_force_errors(dataset: Dataset, point: Coordinates, delays: tuple[float, float]) -> list[Array]:
    """Return simulated less recorded force [N] of each stretch.

    y(0) is estimated on the fitted samples of the stretch, or on all of them where none is fitted.
    """
    return [predict_piece(p, point, delays).force - p.force for p in dataset.pieces]


def select_samples(dataset: Dataset, errors: Sequence[Array], *, held_out: bool) -> tuple[Array, Array]:
    """Return errors and recorded forces [N] of all fitted samples, or of all held-out ones."""
    selected = [
        out & s.valid_mask if held_out else p.train > 0
        for p, out, s in zip(dataset.pieces, dataset.held_out, dataset.stretches, strict=True)
    ]
    return (
        np.concatenate([e[mask] for e, mask in zip(errors, selected, strict=True)]),
        np.concatenate([p.force[mask] for p, mask in zip(dataset.pieces, selected, strict=True)]),
    )


def _describe_result(result: FitResult, noise_ratio: float, delay: Delay) -> str:
    """Return the result of the fit as one line of text, with its force error over the noise floor [1]."""
    if result.failure:
        return f"not converged: {result.failure}"
    if not result.minimum.converged:
        steps = result.minimum.iterations
        return f"not converged: stopped after {steps} steps; raise the budget or hold out less"
    messages = ["converged"]
    if noise_ratio > MISFIT_RATIO:
        messages.append(
            f"the force error is {noise_ratio:.3g} times the noise floor: an effect is missing from the law"
        )
    if delay.outside_prior:
        side = "behind" if delay.value > 0 else "ahead of"
        messages.append(
            f"the force is {1e3 * abs(delay.value):.2g} ms {side} the displacement, more than the clocks explain "
            f"({1e3 * delay.prior_sd:.2g} ms): a filter in a channel, or a phase shift that the law lacks"
        )
    return "; ".join(messages)

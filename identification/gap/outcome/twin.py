"""Twin: the damper with the named effects, as a scenario for the simulated rig and for `predict`."""

from importlib.metadata import version
from typing import cast

import numpy as np

from identification.damper import to_parameters
from identification.damper.definitions import DEFINED_FORM, EffectFile
from identification.documents import (
    Delay,
    DriveError,
    DriveKind,
    Fit,
    FitStage,
    Nuisances,
    Provenance,
    SplitErrors,
    Twin,
    TwinEffect,
)
from identification.fitting import (
    COORDINATE_COUNT,
    Dataset,
    compute_drive_errors,
    compute_nrmse,
    compute_rmse,
    make_effect_entries,
)
from identification.gap.data import EvaluationData, split_by_piece
from identification.gap.fits import Candidate
from identification.pipeline import make_noise_floor
from identification.signals import estimate_recorded_noise
from identification.uncertainty import (
    compute_coordinate_covariance,
    estimate_covariance,
    find_strong_correlations,
    make_coordinate_estimates,
    make_parameter_estimates,
)

_SMALLEST_K1 = 1e-3
"""Smallest stiffness k1 [N/m]; x0 = f0 / k1 needs one."""


def make_twin(
    dataset: Dataset,
    named: Candidate,
    definition: EffectFile | None,
    baseline: Fit,
    floor: float,
    specimen: str,
    provenance: Provenance,
) -> Twin:
    """Make the scenario of a diagnosis.

    Args:
        dataset: the recordings.
        named: the named set; the baseline where none is named.
        definition: definition of the last effect of the set, where it was discovered.
        baseline: document of the fit without effects.
        floor: noise of the force [N].
        specimen: name of the damper.
        provenance: provenance of the diagnosis.
    """
    noise = float(np.median([estimate_recorded_noise(s) for s in dataset.stretches]))
    active = named.fit.active_effects if definition is None else named.fit.active_effects[:-1]
    effects = [TwinEffect.model_validate(e) for e in make_effect_entries(active)]
    if definition is not None:
        effects.append(_make_discovered_effect(definition))
    effect_names = ", ".join(e.name for e in effects) or "no effect"
    coordinates = named.fit.coordinates
    if abs(coordinates.k1) < _SMALLEST_K1:
        coordinates = coordinates._replace(k1=_SMALLEST_K1)
    return Twin(
        description=f"twin of {specimen or 'a damper'}: the law with {effect_names}",
        damper=to_parameters(coordinates)._asdict(),
        drive_kind=cast(DriveKind, baseline.drive_kind),
        drive_unit="A" if baseline.drive_unit == "A" else "V",
        effects=effects,
        sensors={"force": {"noise": floor}, "displacement": {"noise": noise}},
        nuisances=_make_nuisances(named),
        baseline=baseline,
        provenance=provenance,
    )


def _make_discovered_effect(definition: EffectFile) -> TwinEffect:
    values = {name: p.value for name, p in definition.parameters.items()}
    return TwinEffect(name=definition.name, form=DEFINED_FORM, parameters=values, definition=definition)


def make_baseline_fit(
    dataset: Dataset, evaluation: EvaluationData, baseline: Candidate, floor: float, provenance: Provenance
) -> Fit:
    """Make the document of the fit without effects, with its errors on the held-out cycles."""
    problem, minimum = baseline.fit.problem, baseline.fit.minimum
    covariance = estimate_covariance(problem, minimum)
    coordinate_covariance = compute_coordinate_covariance(problem, minimum, covariance)
    names = np.array(baseline.fit.coordinates._fields)
    observable, interior = covariance.observable[:COORDINATE_COUNT], covariance.interior[:COORDINATE_COUNT]
    unit, noise = dataset.drive_unit, dataset.floor
    coordinates = make_coordinate_estimates(
        baseline.fit.coordinates,
        coordinate_covariance,
        set(names[~observable]),
        set(names[observable & ~interior]),
        unit,
    )
    return Fit(
        specimen=dataset.recordings[0].metadata["run"].get("specimen", ""),
        drive_kind=dataset.recordings[0].drive_kind,
        drive_unit=unit,
        drive_range=(problem.space.lowest_drive, problem.space.highest_drive),
        parameters=make_parameter_estimates(baseline.fit.coordinates, coordinate_covariance, coordinates, unit),
        coordinates=coordinates,
        nuisances=_make_nuisances(baseline),
        noise_floor_n=floor,
        floor=make_noise_floor(noise, baseline.train_rmse),
        rmse_n=SplitErrors(train=baseline.train_rmse, validation=None, held_out=baseline.held_out_rmse),
        nrmse=_compute_relative_errors(evaluation, baseline),
        per_drive=_compute_drive_errors(evaluation, baseline, unit),
        stages=[
            _make_stage(compute_rmse(baseline.residual.values[evaluation.fitted_samples]), minimum.iterations)
        ],
        agreement=None,
        result="converged" if minimum.converged else f"not converged: stopped after {minimum.iterations} steps",
        correlations=find_strong_correlations(coordinate_covariance),
        provenance=Provenance(
            logs=provenance.logs, version=version("mrbench"), seed=provenance.seed, settings={"stages": "refine"}
        ),
    )


def _compute_relative_errors(evaluation: EvaluationData, baseline: Candidate) -> SplitErrors:
    """Compute the NRMSE on the fitted and on the held-out samples."""
    residual, force = baseline.residual.values, evaluation.force
    fitted, held_out = evaluation.fitted_samples, evaluation.held_out_samples
    return SplitErrors(
        train=compute_nrmse(residual[fitted], force[fitted]),
        validation=None,
        held_out=compute_nrmse(residual[held_out], force[held_out]),
    )


def _compute_drive_errors(evaluation: EvaluationData, baseline: Candidate, unit: str) -> list[DriveError]:
    """Compute the force error at each drive; errors are simulated less recorded force."""
    pieces = evaluation.pieces
    errors = [-part for part in split_by_piece(baseline.residual.values, pieces)]
    return compute_drive_errors([p.excitation.drive for p in pieces], errors, [p.force for p in pieces], unit)


def _make_stage(rmse: float, iterations: int) -> FitStage:
    note = "baseline of a diagnosis, with channel delays limited to the error of their clocks"
    return FitStage(name="refine", seconds=0.0, rmse_n=rmse, iterations=iterations, note=note)


def _make_nuisances(candidate: Candidate) -> Nuisances:
    """Return y(0) of each stretch and the residual delays of the channels."""
    unknowns, problem = candidate.fit.minimum.unknowns, candidate.fit.problem
    limit = 1e6 * problem.delay_limit * problem.delay_prior
    force, drive = (
        Delay(
            value=float(unknowns[column]) * problem.delay_prior,
            ci95=None,
            prior_sd=problem.delay_prior,
            outside_prior=False,
            note=f"limited to {limit:.3g} µs; a larger delay counts as an effect",
        )
        for column in (COORDINATE_COUNT, COORDINATE_COUNT + 1)
    )
    starts = {p.name: problem.make_model(unknowns, i).y0 for i, p in enumerate(problem.pieces)}
    return Nuisances(y0=starts, force_delay=force, drive_delay=drive)

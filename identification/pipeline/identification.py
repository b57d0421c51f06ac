"""Identification of one or several logs: network, output-error fit, comparison of both, document."""

import time
from collections.abc import Sequence
from dataclasses import replace
from importlib.metadata import version
from typing import TYPE_CHECKING

import numpy as np

from identification.arrays import Array
from identification.documents import Fit, FitStage, Provenance
from identification.errors import IdentificationError
from identification.fitting import Dataset, Minimum, Problem, compute_rmse, fit_output_error
from identification.logs import Recording, Stretch
from identification.numerical_errors import translate_numerical_errors
from identification.pipeline.fit_document import (
    MISFIT_RATIO,
    FitResult,
    compute_force_errors,
    make_fit_document,
    select_samples,
)
from identification.pipeline.fit_input import FitInput, prepare_fit
from identification.pipeline.fit_request import FitRequest
from identification.pipeline.pinn_stage import (
    NetworkResult,
    compare_with_network,
    make_minimum,
    make_stage_entry,
    train_network,
)
from identification.progress import Progress, enter_stage, ignore_progress
from identification.signals import describe_outlier_logs
from identification.uncertainty import (
    Covariance,
    compute_profile_intervals,
    correct_clock_drift,
    describe_clock_drift,
    estimate_covariance,
    estimate_step_shifts,
    find_unobservable,
    reestimate_motion,
    remove_bias,
    resample_input_noise,
    shift_steps,
)

if TYPE_CHECKING:
    from identification.pinn.common import PinnResult

_DEFAULT_REQUEST = FitRequest()


def identify(
    recordings: Sequence[Recording],
    request: FitRequest = _DEFAULT_REQUEST,
    progress: Progress = ignore_progress,
) -> Fit:
    """Identify the damper from recordings of it.

    Args:
        recordings: one or several logs of one specimen, driven in the same way.
        request: held-out samples, stages, budget and options.
        progress: receives the present activity and the force error so far [N].

    Raises:
        UnusableDataError: too few usable samples are left to fit, or they do not determine a damper.
    """
    with translate_numerical_errors():
        return fit_damper(prepare_fit(recordings, request), request, progress)


def fit_damper(
    prepared: FitInput, request: FitRequest, progress: Progress, network: NetworkResult | None = None
) -> Fit:
    """Fit usable recordings; the network is trained here unless its result is given."""
    dataset, problem, stretches = prepared.dataset, prepared.problem, prepared.stretches
    stages = ("read", *request.stages, *(("profile",) if request.profile else ()))
    if network is None and "pinn" in request.stages:
        progress = enter_stage(progress, "pinn", stages.index("pinn"), len(stages))
        preset, seed = request.preset, request.settings.seed
        network = train_network(problem, stretches, preset, seed, request.network_budget, progress)
    if "refine" in request.stages:
        progress = enter_stage(progress, "refine", stages.index("refine"), len(stages))
        # Without the network's result as a start, so that the comparison is one of two independent estimates.
        result = _fit_output_error(dataset, problem, stretches, request, progress)
        result = _compare_stages(dataset, result, network) if network else result
    else:
        result = _take_network_fit(dataset, problem, network)
    dataset = apply_corrections(dataset, result.problem, result.minimum.unknowns[problem.shared_columns])
    fit = make_fit_document(dataset, result, _make_provenance(dataset, request, problem))
    if request.profile:
        progress = enter_stage(progress, "profile", stages.index("profile"), len(stages))
        fit = _add_profile_intervals(fit, result, progress)
    return fit.model_copy(update={"notes": [*prepared.notes, *result.notes, *_describe_outliers(dataset, fit)]})


def _add_profile_intervals(fit: Fit, result: FitResult, progress: Progress) -> Fit:
    """Return the fit with profile-likelihood intervals added."""
    intervals = compute_profile_intervals(result.problem, result.minimum, result.covariance, progress)
    coordinates = {
        name: e.model_copy(update={"profile95": intervals.get(name)}) for name, e in fit.coordinates.items()
    }
    return fit.model_copy(update={"coordinates": coordinates})


def _describe_outliers(dataset: Dataset, fit: Fit) -> list[str]:
    """Return notes on logs that the common damper does not fit."""
    names = [r.path.name for r in dataset.recordings for _ in r.stretches]
    delays = (fit.nuisances.force_delay.value, fit.nuisances.drive_delay.value)
    if len(set(names)) < 2:
        return []
    errors = compute_force_errors(dataset, fit.to_coordinates(), delays)
    return describe_outlier_logs(names, errors, fit.rmse_n.train / fit.noise_floor_n)


def _fit_output_error(
    dataset: Dataset, problem: Problem, stretches: Sequence[Stretch], request: FitRequest, progress: Progress
) -> FitResult:
    """Fit the output error from separate starts, without any result of the network."""
    start_time = time.process_time()
    settings = replace(request.settings, budget=request.output_error_budget)
    minimum = fit_output_error(problem.make_fast(), settings, progress)
    # The search runs at the samples alone. Filter and backlash enter the final fit only (decision 0004).
    final_settings = replace(settings, restarts=0)
    shifts = estimate_step_shifts(problem, minimum.unknowns)
    if shifts is not None:
        problem = shift_steps(problem, shifts)
        minimum = fit_output_error(problem.make_fast(), final_settings, progress, minimum.unknowns)
    scatter, notes = None, tuple[str, ...]()
    if _compute_noise_ratio(problem, minimum) > MISFIT_RATIO:
        # The misfit outweighs the effect of input noise, which is not resampled then (decision 0005).
        problem = replace(problem, noise=problem.noise * _compute_noise_ratio(problem, minimum))
        minimum = fit_output_error(problem, final_settings, progress, minimum.unknowns)
    else:
        # From the simulated force: the recorded one would bring its noise into the motion.
        problem = reestimate_motion(problem, stretches, problem.simulate(minimum.unknowns))
        minimum = fit_output_error(problem, final_settings, progress, minimum.unknowns)
        input_noise = resample_input_noise(problem, stretches, minimum, request.settings.seed)
        minimum, scatter = remove_bias(problem, minimum, input_noise.bias), input_noise.scatter
        # The last step, because the minimum then carries the information that clock drift leaves; evaluating the
        # problem again would lose it.
        minimum, drift = correct_clock_drift(problem, minimum)
        notes = describe_clock_drift(drift)
    covariance = estimate_covariance(problem, minimum, scatter)
    seconds = time.process_time() - start_time
    corrected = apply_corrections(dataset, problem, minimum.unknowns[problem.shared_columns])
    errors = _compute_errors(corrected, problem, minimum)
    error = compute_rmse(select_samples(dataset, errors, held_out=False)[0])
    stage = FitStage(name="refine", seconds=round(seconds, 3), rmse_n=error, iterations=minimum.iterations)
    return FitResult(problem, minimum, covariance, (stage,), notes=notes, errors=tuple(errors))


def _take_network_fit(dataset: Dataset, problem: Problem, network: NetworkResult | None) -> FitResult:
    """Return the fit that the network alone provides.

    Raises:
        IdentificationError: the training has no result.
    """
    if network is None or network.result is None:
        reason = network.failure if network else "no stage was requested"
        raise IdentificationError(f"pinn found nothing: {reason}; raise --budget or use --stages refine")
    trained = network.result
    minimum, covariance = make_minimum(problem, trained)
    entry = _describe_network(dataset, problem, covariance, trained)
    return FitResult(problem, minimum, covariance, (entry,), failure="" if trained.accepted else trained.note)


def _compare_stages(dataset: Dataset, result: FitResult, network: NetworkResult) -> FitResult:
    """Return the output-error fit with the network's stage entry and the agreement of both."""
    trained = network.result
    if trained is None:
        return replace(result, agreement_note=f"not compared: pinn found nothing, {network.failure}")
    agreement = compare_with_network(trained, result.problem, result.minimum, result.covariance)
    note = agreement.describe() if trained.accepted else f"{agreement.describe()} (pinn: {trained.note})"
    entry = _describe_network(dataset, result.problem, result.covariance, trained)
    return replace(result, stages=(entry, *result.stages), agreement=agreement, agreement_note=note)


def _describe_network(
    dataset: Dataset, problem: Problem, covariance: Covariance, network: "PinnResult"
) -> FitStage:
    """Return the network's stage entry, with its own errors."""
    corrected = apply_corrections(dataset, problem, network.unknowns)
    errors = compute_force_errors(corrected, network.coordinates, network.delays)
    held_out, _ = select_samples(dataset, errors, held_out=True)
    unobservable, _ = find_unobservable(covariance)
    rmse = compute_rmse(held_out) if len(held_out) else None
    return make_stage_entry(network, unobservable, rmse, dataset.drive_unit)


def _compute_errors(dataset: Dataset, problem: Problem, minimum: Minimum) -> list[Array]:
    """Return the force errors (N,) [N] of all stretches at a minimum."""
    point = problem.space.to_coordinates(minimum.unknowns[problem.layout.coordinates])
    return compute_force_errors(dataset, point, problem.compute_residual_delays(minimum.unknowns))


def apply_corrections(dataset: Dataset, problem: Problem, shared: Array) -> Dataset:
    """Return the dataset with the steps of the problem's drives and the fitted corrections of its logs.

    The corrections follow from the unknowns (C,) that all pieces share.
    """
    drives = {p.name: p.excitation.drive for p in problem.pieces if p.step_shifts is not None}
    if not problem.per_log and not drives:
        return dataset
    corrections = {p.log: problem.find_correction(shared, i) for i, p in enumerate(problem.pieces)}
    pieces = tuple(
        replace(
            p,
            correction=corrections.get(p.log, p.correction),
            excitation=replace(p.excitation, drive=drives.get(p.name, p.excitation.drive)),
        )
        for p in dataset.pieces
    )
    return replace(dataset, pieces=pieces)


def _compute_noise_ratio(problem: Problem, minimum: Minimum) -> float:
    """Return the force error over the noise of the problem [1]."""
    return float(np.sqrt(minimum.evaluation.cost / problem.samples))


def _make_provenance(dataset: Dataset, request: FitRequest, problem: Problem) -> Provenance:
    return Provenance(
        logs={r.path.name: r.sha256 for r in dataset.recordings},
        version=version("mrbench"),
        seed=request.settings.seed,
        settings={
            "stages": ",".join(request.stages),
            "preset": _name_preset(request),
            "hold_out": ",".join(request.hold_out.patterns) or None,
            "hold_out_after": request.hold_out.after_fraction,
            "delay_prior_s": problem.delay_prior,
            "free": ",".join(request.per_log) or None,
            "restarts": request.settings.restarts,
            "budget": str(request.settings.budget) or None,
            "reproducible": request.settings.budget.seconds is None,
        },
    )


def _name_preset(request: FitRequest) -> str | None:
    """Return the present name of the network's preset; None where no network is trained."""
    if "pinn" not in request.stages:
        return None
    from identification.pinn.common import rename_preset

    return rename_preset(request.preset)

"""Diagnosis of one or several logs of one damper."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from identification.damper.effects import EFFECTS, Effect
from identification.fitting import DELAY_LIMIT, DamperModel, Dataset, HoldOut, Piece, Problem, assemble
from identification.gap.data import (
    EvaluationData,
    check_cycle_count,
    check_sliding_recorded,
)
from identification.gap.discovery import compare_with_curves
from identification.gap.noise import NoiseModel
from identification.gap.outcome import DiagnosisResult, ReportBuilder, cross_check_effects
from identification.gap.selection import (
    DEFAULT_SETTINGS,
    UNKNOWN_THRESHOLD,
    CandidatePool,
    SearchProblems,
    SearchSettings,
    compute_final_posterior,
    find_partial_sets,
    search_forward,
    settle_floor,
)
from identification.logs import Recording
from identification.numerical_errors import translate_numerical_errors
from identification.pipeline import make_problem
from identification.progress import Progress, enter_stage, ignore_progress
from identification.signals import check_recordings, check_single_specimen, mask_invalid_samples
from identification.threads import use_one_thread

_CLOCK_DEVIATION = 5e-5
"""Standard deviation of the delay between channels that clocks and filters usually leave [s]."""
_STAGE_COUNT = 4
"""Number of stages that report their progress: read, search, compare, conclude."""


def diagnose(
    recordings: Sequence[Recording],
    model: DamperModel | None = None,
    *,
    seed: int = 1,
    cross_check: bool = False,
    hold_out: HoldOut | None = None,
    progress: Progress = ignore_progress,
    settings: SearchSettings = DEFAULT_SETTINGS,
    library: Mapping[str, Effect] | None = None,
    discover: bool = False,
    learn_residual: bool = False,
) -> DiagnosisResult:
    """Diagnose the gap between the law and recordings of one damper.

    Args:
        recordings: one or several logs of one specimen.
        model: a simulation whose own gap is reported as well.
        seed: seed of all random numbers.
        cross_check: train a network with the named effects and compare its estimates.
        hold_out: strokes that no fit and no choice reads; the error on them is reported.
        progress: receives the fitted effects and the force error on held-out cycles [N].
        settings: limits and thresholds of the search.
        library: effects that the search considers, by name; those that come with the program if None.
        discover: also search for a cause outside the library, where the named effects do not explain the gap.
        learn_residual: learn the residual of law and effects, for predictions with the twin.

    Raises:
        UnusableDataError: the recordings are too short, clipped, of different specimens, or do not contain force
            and motion of a damper; or they do not determine one.
    """
    prepared = prepare_recordings(recordings, hold_out)
    return diagnose_prepared(
        prepared,
        model,
        seed=seed,
        cross_check=cross_check,
        progress=progress,
        settings=settings,
        library=library,
        discover=discover,
        learn_residual=learn_residual,
    )


@dataclass(frozen=True)
class PreparedRecordings:
    """Recordings prepared for a diagnosis."""

    dataset: Dataset
    evaluation: EvaluationData
    notes: list[str]
    """Messages about excluded samples."""


@translate_numerical_errors()
def prepare_recordings(recordings: Sequence[Recording], hold_out: HoldOut | None = None) -> PreparedRecordings:
    """Check, clean and smooth recordings of one damper, and cut them into cycles.

    ``hold_out`` selects strokes that no fit and no choice reads.

    Raises:
        UnusableDataError: as in ``diagnose``.
    """
    with use_one_thread():
        check_single_specimen(recordings, "diagnose")
        check_recordings(recordings)
        cleaned, notes = mask_invalid_samples(recordings)
        dataset = assemble(cleaned, hold_out or HoldOut())
        evaluation = EvaluationData.make(dataset)
    check_cycle_count(evaluation.cycles)
    check_sliding_recorded(dataset.pieces)
    return PreparedRecordings(dataset, evaluation, [*dataset.notes, *evaluation.notes, *notes])


@translate_numerical_errors()
def diagnose_prepared(
    prepared: PreparedRecordings,
    model: DamperModel | None = None,
    *,
    seed: int = 1,
    cross_check: bool = False,
    progress: Progress = ignore_progress,
    settings: SearchSettings = DEFAULT_SETTINGS,
    library: Mapping[str, Effect] | None = None,
    discover: bool = False,
    learn_residual: bool = False,
) -> DiagnosisResult:
    """Diagnose prepared recordings; the arguments are those of ``diagnose``."""
    dataset = prepared.dataset
    pool = make_candidate_pool(prepared, seed=seed, progress=progress, settings=settings, library=library)
    with use_one_thread():
        pool.progress = enter_stage(progress, "search", 1, _STAGE_COUNT)
        search_forward(pool)
        evaluation = pool.evaluation
        pool.progress = enter_stage(progress, "compare", 2, _STAGE_COUNT)
        if settle_floor(pool, pool.candidates.values()):
            pool.update_residuals()
        posterior = compare_with_curves(pool, compute_final_posterior(pool))
        partial = find_partial_sets(pool, posterior) if posterior.unknown > UNKNOWN_THRESHOLD else None
        notes = [*prepared.notes, *pool.notes]
        progress = pool.progress = enter_stage(progress, "conclude", 3, _STAGE_COUNT)
        builder = ReportBuilder(
            dataset, evaluation, pool, posterior, partial, model, notes, seed, discover, learn_residual
        )
        result = builder.build_result()
        return _add_cross_check(result, pool, dataset.drive_unit, seed, progress) if cross_check else result


def _add_cross_check(
    result: DiagnosisResult, pool: CandidatePool, drive_unit: str, seed: int, progress: Progress
) -> DiagnosisResult:
    """Add the network's independent estimate of the named effects, if any are named."""
    named = frozenset(effect.name for effect in result.diagnosis.effects)
    if not named:
        return result
    fit = pool.candidates[named].fit
    comparison = cross_check_effects(
        fit, pool.problems.full.replace_effects(fit.effects), drive_unit, seed, progress
    )
    return replace(result, diagnosis=result.diagnosis.model_copy(update={"cross_check": comparison}))


def make_candidate_pool(
    prepared: PreparedRecordings,
    *,
    seed: int = 1,
    progress: Progress = ignore_progress,
    settings: SearchSettings = DEFAULT_SETTINGS,
    library: Mapping[str, Effect] | None = None,
) -> CandidatePool:
    """Make an empty candidate pool for prepared recordings."""
    dataset, evaluation = prepared.dataset, prepared.evaluation
    problem = make_diagnosis_problem(dataset, evaluation.select_fitted_pieces())
    noise_model = NoiseModel(dataset.floor, dataset.stretches, seed)
    clock_deviation = dataset.clock_deviation if dataset.clock_deviation > _CLOCK_DEVIATION else 0.0
    problems = SearchProblems(problem, settings)
    return CandidatePool(problems, evaluation, noise_model, clock_deviation, progress, library or EFFECTS)


def make_diagnosis_problem(dataset: Dataset, pieces: tuple[Piece, ...]) -> Problem:
    """Make the fit problem of a diagnosis.

    Delays are limited to the error of the clocks, because a larger delay is an effect. Each log after the first
    has its own force offset, because the zero of the load cell differs from run to run.
    """
    problem = make_problem(dataset, _CLOCK_DEVIATION)
    return replace(
        problem,
        pieces=pieces,
        delay_limit=DELAY_LIMIT,
        per_log=("offset",) if len(dataset.recordings) > 1 else (),
    )

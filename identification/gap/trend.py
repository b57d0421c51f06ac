"""Trend over the runs of one specimen.

Each run is diagnosed alone. The effects that any run names are then fitted together with the law in all runs,
in one form each. An effect thus has a size even in runs where it was too small to be named. A quantity has changed
if a line with a change point, constant before it and linear after it, differs significantly from a constant.
"""

from collections.abc import Sequence
from dataclasses import replace
from importlib.metadata import version
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper import COORDINATES
from identification.documents import (
    Diagnosis,
    Provenance,
    QuantityTrend,
    Trend,
    TrendDirection,
    TrendRun,
    TrendValue,
)
from identification.errors import UnusableDataError
from identification.fitting import COORDINATE_COUNT, EffectModel
from identification.gap.diagnosis import (
    PreparedRecordings,
    diagnose_prepared,
    make_diagnosis_problem,
    prepare_recordings,
)
from identification.gap.fits import JointFit, fit_jointly
from identification.gap.outcome import suggest_check
from identification.logs import Recording
from identification.progress import Progress, ignore_progress
from identification.signals import check_single_specimen
from identification.uncertainty import Z95_ROUNDED

MIN_RUNS = 3
"""Smallest number of runs of a trend."""
_CHANGE_DEVIATIONS = 5.0
"""Smallest change of a quantity [standard deviations of the change]."""
_MIN_LAW_CHANGE = 0.1
"""Smallest change of a coordinate of the law, relative to its largest value; an inexact form causes less."""
_EFFECT_PROBABILITY = 0.5
"""Probability of an effect in one run, above which it is fitted in all runs."""
_VERBS: dict[TrendDirection, str] = {"rising": "rises", "falling": "falls", "steady": "is steady"}


class ChangePoint(NamedTuple):
    """Change point of a quantity: constant before it, linear after it."""

    start: int
    """Index of the last run before the change."""
    slope: float
    """Change per run after it."""
    deviations: float
    """Total change over its standard deviation [1]."""


def analyse_trend(
    recordings: Sequence[Recording],
    *,
    seed: int = 1,
    progress: Progress = ignore_progress,
) -> Trend:
    """Find changes over the runs of one specimen.

    Args:
        recordings: one log for each run, in the order of time.
        seed: seed of all random numbers.
        progress: receives the fitted effects and the force error [N].

    Raises:
        UnusableDataError: fewer than three runs, different specimens, or a run that cannot be diagnosed.
    """
    if len(recordings) < MIN_RUNS:
        raise UnusableDataError(f"a trend needs at least {MIN_RUNS} runs; {len(recordings)} were given")
    check_single_specimen(recordings, "diagnose")
    prepared = [prepare_recordings([r]) for r in recordings]
    diagnoses = [diagnose_prepared(p, seed=seed, progress=progress).diagnosis for p in prepared]
    common = collect_effects(diagnoses)
    fits = [_fit_run(p, common) for p in prepared]
    logs = [r.path.name for r in recordings]
    changes = [
        *_find_effect_changes(fits, common, logs, recordings[0].drive_unit),
        *_find_law_changes(fits, logs, recordings[0].drive_unit),
    ]
    return Trend(
        specimen=recordings[0].metadata["run"].get("specimen", ""),
        runs=[_summarise_run(log, d) for log, d in zip(logs, diagnoses, strict=True)],
        effects=[model.name for model in common],
        changes=changes,
        explanation=explain_changes(changes, len(logs)),
        provenance=Provenance(
            logs={r.path.name: r.sha256 for r in recordings},
            version=version("mrbench"),
            seed=seed,
            settings={"runs": len(logs)},
        ),
    )


def collect_effects(diagnoses: Sequence[Diagnosis]) -> tuple[EffectModel, ...]:
    """Return the effects that any run names, each in the form of the run with the highest probability."""
    best: dict[str, tuple[float, str]] = {}
    for effect in (e for d in diagnoses for e in d.effects if e.probability > _EFFECT_PROBABILITY):
        known = best.get(effect.name)
        if known is None or effect.probability >= known[0]:
            best[effect.name] = (effect.probability, effect.form)
    return tuple(EffectModel.from_name(name, form) for name, (_, form) in best.items())


def _fit_run(run: PreparedRecordings, effects: tuple[EffectModel, ...]) -> JointFit:
    """Fit the law with the effects to all samples of one run."""
    problem = make_diagnosis_problem(run.dataset, run.evaluation.pieces)
    size = problem.space.scales.damper_size
    return fit_jointly(problem, tuple(replace(model, size=size) for model in effects))


def _summarise_run(log: str, diagnosis: Diagnosis) -> TrendRun:
    return TrendRun(
        log=log,
        verdict=diagnosis.verdict,
        effects=[e.name for e in diagnosis.effects],
        before_n=diagnosis.gap.before_n,
        noise_floor_n=diagnosis.gap.noise_floor_n,
    )


def _find_effect_changes(
    fits: Sequence[JointFit], effects: Sequence[EffectModel], logs: Sequence[str], unit: str
) -> list[QuantityTrend]:
    """Return the trends of the effects' sizes; lengths, speeds and times only set their shape."""
    quantities = [(model, q) for model in effects for q in model.quantities]
    values = np.array([[fit.values[model.name][q.symbol] for model, q in quantities] for fit in fits])
    deviations = np.array([_compute_deviations(fit)[COORDINATE_COUNT:] for fit in fits])
    return [
        _make_quantity_trend(
            f"{model.name}.{q.symbol}", q.format_unit(unit), logs, values[:, k], deviations[:, k], 0.0
        )
        for k, (model, q) in enumerate(quantities)
        if q.low <= 0.0
    ]


def _find_law_changes(fits: Sequence[JointFit], logs: Sequence[str], unit: str) -> list[QuantityTrend]:
    """Return the trends of the law's coordinates."""
    values = np.array([fit.coordinates for fit in fits])
    deviations = np.array([_compute_deviations(fit)[:COORDINATE_COUNT] for fit in fits])
    return [
        _make_quantity_trend(q.symbol, q.format_unit(unit), logs, values[:, k], deviations[:, k], _MIN_LAW_CHANGE)
        for k, q in enumerate(COORDINATES)
    ]


def _compute_deviations(fit: JointFit) -> Array:
    """Return standard deviations (13 + P,) of coordinates and effects [SI]; infinite where they are undetermined.

    A size at its bound of zero has a deviation as well, which the intervals of a single diagnosis omit.
    """
    problem, unknowns = fit.problem, fit.minimum.unknowns
    free, effects = problem.free_mask, problem.layout.effects
    information = fit.minimum.evaluation.hessian[np.ix_(free, free)] / max(fit.ratio, 1.0) ** 2
    # With a diagonal of ones, the tolerance applies to directions and not to units.
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    covariance = np.zeros((len(free), len(free)))
    covariance[np.ix_(free, free)] = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-12) / np.outer(
        scale, scale
    )
    derivatives = problem.space.differentiate(unknowns[:COORDINATE_COUNT])
    law = np.diag(derivatives @ covariance[:COORDINATE_COUNT, :COORDINATE_COUNT] @ derivatives.T)
    sizes = np.diag(covariance)[effects] * problem.differentiate_effects(unknowns) ** 2
    variance = np.concatenate([law, sizes])
    return np.where(variance > 0.0, np.sqrt(np.maximum(variance, 0.0)), np.inf)


def _make_quantity_trend(
    quantity: str, unit: str, logs: Sequence[str], values: Array, deviations: Array, min_change: float
) -> QuantityTrend:
    """Make the trend of one quantity; ``min_change`` is relative to its largest value [1]."""
    point = find_change_point(values, deviations)
    change = point.slope * (len(values) - 1 - point.start)
    changed = point.deviations > _CHANGE_DEVIATIONS and abs(change) > min_change * float(np.abs(values).max())
    direction: TrendDirection = "steady" if not changed else "rising" if point.slope > 0.0 else "falling"
    return QuantityTrend(
        quantity=quantity,
        unit=unit,
        direction=direction,
        since=logs[point.start + 1] if changed else None,
        change_per_run=point.slope if changed else 0.0,
        deviations=point.deviations,
        values=[_make_value(*row) for row in zip(logs, values, deviations, strict=True)],
    )


def _make_value(log: str, value: float, deviation: float) -> TrendValue:
    if not np.isfinite(deviation):
        return TrendValue(log=log, value=float(value), ci95=None)
    width = Z95_ROUNDED * deviation
    return TrendValue(log=log, value=float(value), ci95=(value - width, value + width))


def find_change_point(values: Array, deviations: Array) -> ChangePoint:
    """Return the change point that fits a quantity best over its runs (R,).

    If the values scatter more than their deviations, the deviation of the change is increased accordingly. Runs
    with an infinite deviation do not count.
    """
    weights = np.where(np.isfinite(deviations), 1.0 / np.maximum(deviations, 1e-300), 0.0)
    if np.count_nonzero(weights) < MIN_RUNS:
        return ChangePoint(0, 0.0, 0.0)
    fits = (_fit_change_point(values, weights, start) for start in range(len(values) - 1))
    return min(fits, key=lambda cost_and_point: cost_and_point[0])[1]


def _fit_change_point(values: Array, weights: Array, start: int) -> tuple[float, ChangePoint]:
    """Return the sum of squared errors with the change point after a run, and the change point."""
    ramp = np.maximum(np.arange(len(values)) - start, 0.0)
    table = np.column_stack([np.ones(len(values)), ramp])
    solution = np.linalg.lstsq(table * weights[:, None], values * weights, rcond=None)[0]
    cost = float(np.sum(((values - table @ solution) * weights) ** 2))
    inverse = np.linalg.pinv((table * weights[:, None]).T @ (table * weights[:, None]))
    scatter = max(cost / max(int(np.count_nonzero(weights)) - 2, 1), 1.0)
    deviation = float(np.sqrt(inverse[1, 1] * scatter))
    slope = float(solution[1])
    return cost, ChangePoint(start, slope, abs(slope) / max(deviation, 1e-300))


def explain_changes(changes: Sequence[QuantityTrend], runs: int) -> str:
    """Return the changes as text for a person."""
    moving = sorted(
        (c for c in changes if c.direction != "steady"), key=lambda c: ("." not in c.quantity, -c.deviations)
    )
    if not moving:
        return f"Over {runs} runs, no quantity rises or falls significantly."
    sentences = "; ".join(_describe_change(c) for c in moving)
    names = dict.fromkeys(c.quantity.split(".")[0] for c in moving if "." in c.quantity)
    checks = "; ".join(suggest_check(name) for name in names)
    return f"Over {runs} runs: {sentences}." + (f" Check: {checks}." if checks else "")


def _describe_change(trend: QuantityTrend) -> str:
    unit = "" if trend.unit == "1" else f" {trend.unit}"
    return (
        f"{trend.quantity} {_VERBS[trend.direction]} by {abs(trend.change_per_run):.3g}{unit} per run "
        f"since {trend.since} ({trend.values[0].value:.3g} to {trend.values[-1].value:.3g})"
    )

"""A specimen's life: what grows from run to run, and since when.

Each run is diagnosed alone. What any of them names is then fitted beside the law in all of them, in one form, so
that an effect has a size also where it was still too small to be named. A quantity changes where a line with a
bend, level before it and straight after, stands clearly above a level line.
"""

from collections.abc import Sequence
from importlib.metadata import version
from typing import NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper.coordinates import COORDINATES
from identification.effect_choice import EffectChoice
from identification.errors import NothingToFit
from identification.gap.checks import one_specimen
from identification.gap.diagnose import Prepared, Progress, diagnose_prepared, diagnosed_problem, prepare
from identification.gap.documents import Diagnosis
from identification.gap.explain import Effort, JointFit, fit_with
from identification.gap.trend_documents import Change, RunOfLife, Size, Trend, Way
from identification.gap.words import advice
from identification.problem import COORDINATE_COUNT
from identification.recordings import Recording
from identification.results import Provenance

FEWEST = 3
"""Runs without which there is no trend."""
_CLEAR = 5.0
"""[1] whole change over its standard deviation from which on a quantity counts as changed."""
_LARGE = 0.1
"""[1] least change of a coordinate of the law, over its largest size: a form that is not exact moves it less."""
_LIKELY = 0.5
"""[1] probability from which on an effect of one run is looked for in all."""


class Bend(NamedTuple):
    """A level line, then a straight one."""

    start: int
    """Index of the last run on the level."""
    slope: float
    """From run to run behind it."""
    deviations: float
    """[1] whole change over its standard deviation."""


def trend(
    recordings: Sequence[Recording],
    *,
    seed: int = 1,
    progress: Progress = lambda what, error: None,
) -> Trend:
    """What changes over the runs of one specimen.

    Args:
        recordings: one log a run, in the order of time.
        seed: of everything that chance decides.
        progress: told what is fitted and the force error so far [N].

    Raises:
        NothingToFit: fewer than three runs, different specimens, or a run that cannot be diagnosed.
    """
    if len(recordings) < FEWEST:
        raise NothingToFit(f"{len(recordings)} runs are no trend; give the logs of at least {FEWEST}")
    one_specimen(recordings)
    prepared = [prepare([r]) for r in recordings]
    found = [diagnose_prepared(p, seed=seed, progress=progress).diagnosis for p in prepared]
    common = common_effects(found)
    fits = [_fitted(p, common) for p in prepared]
    logs = [r.path.name for r in recordings]
    changes = [
        *_of_effects(fits, common, logs, recordings[0].drive_unit),
        *_of_law(fits, logs, recordings[0].drive_unit),
    ]
    return Trend(
        specimen=recordings[0].metadata["run"].get("specimen", ""),
        runs=[_run(log, d) for log, d in zip(logs, found, strict=True)],
        effects=[choice.name for choice in common],
        changes=changes,
        explanation=explained(changes, len(logs)),
        provenance=Provenance(
            logs={r.path.name: r.sha256 for r in recordings},
            version=version("mrbench"),
            seed=seed,
            settings={"runs": len(logs)},
        ),
    )


def common_effects(found: Sequence[Diagnosis]) -> tuple[EffectChoice, ...]:
    """What any run names, each in the form of the run that is surest of it."""
    surest: dict[str, tuple[float, str]] = {}
    for effect in (e for diagnosis in found for e in diagnosis.effects if e.probability > _LIKELY):
        known = surest.get(effect.name)
        if known is None or effect.probability >= known[0]:
            surest[effect.name] = (effect.probability, effect.form)
    return tuple(EffectChoice(name, form) for name, (_, form) in surest.items())


def _fitted(run: Prepared, effects: tuple[EffectChoice, ...]) -> JointFit:
    """The law with the effects, fitted to all samples of one run."""
    return fit_with(diagnosed_problem(run.assembled, run.judge.pieces), effects, None, Effort())


def _run(log: str, diagnosis: Diagnosis) -> RunOfLife:
    return RunOfLife(
        log=log,
        verdict=diagnosis.verdict,
        effects=[e.name for e in diagnosis.effects],
        before_n=diagnosis.gap.before_n,
        noise_floor_n=diagnosis.gap.noise_floor_n,
    )


def _of_effects(
    fits: Sequence[JointFit], effects: Sequence[EffectChoice], logs: Sequence[str], unit: str
) -> list[Change]:
    """Changes of the effects' sizes; lengths, speeds and times only shape them."""
    quantities = [(choice, q) for choice in effects for q in choice.quantities]
    values = np.array([[fit.values[choice.name][q.symbol] for choice, q in quantities] for fit in fits])
    deviations = np.array([_deviations(fit)[COORDINATE_COUNT:] for fit in fits])
    return [
        _change(f"{choice.name}.{q.symbol}", q.unit_for(unit), logs, values[:, k], deviations[:, k], 0.0)
        for k, (choice, q) in enumerate(quantities)
        if q.low <= 0.0
    ]


def _of_law(fits: Sequence[JointFit], logs: Sequence[str], unit: str) -> list[Change]:
    """Changes of the law's coordinates."""
    values = np.array([fit.coordinates for fit in fits])
    deviations = np.array([_deviations(fit)[:COORDINATE_COUNT] for fit in fits])
    return [
        _change(q.symbol, q.unit_for(unit), logs, values[:, k], deviations[:, k], _LARGE)
        for k, q in enumerate(COORDINATES)
    ]


def _deviations(fit: JointFit) -> Array:
    """Standard deviations (13 + P,) of coordinates and effects [SI]; infinite where the strokes say nothing.

    Also of a size that stands at its bound of zero, which the intervals of a single diagnosis leave open.
    """
    problem, unknowns = fit.problem, fit.minimum.unknowns
    free, effects = problem.free, slice(problem.first_effect, problem.first_own)
    known = fit.minimum.evaluation.hessian[np.ix_(free, free)] / max(fit.ratio, 1.0) ** 2
    scale = np.sqrt(np.maximum(np.diag(known), 1e-300))
    whole = np.zeros((len(free), len(free)))
    whole[np.ix_(free, free)] = np.linalg.pinv(known / np.outer(scale, scale), rcond=1e-12) / np.outer(
        scale, scale
    )
    slopes = problem.space.slopes(unknowns[:COORDINATE_COUNT])
    law = np.diag(slopes @ whole[:COORDINATE_COUNT, :COORDINATE_COUNT] @ slopes.T)
    at, own = effects.start, []
    for choice in fit.effects:
        own.append(choice.slopes(unknowns[at : at + len(choice.quantities)]))
        at += len(choice.quantities)
    variance = np.concatenate([law, np.diag(whole)[effects] * np.concatenate([*own, np.empty(0)]) ** 2])
    return np.where(variance > 0.0, np.sqrt(np.maximum(variance, 0.0)), np.inf)


def _change(
    quantity: str,
    unit: str,
    logs: Sequence[str],
    values: Array,
    deviations: Array,
    least: float,
) -> Change:
    bend = bent(values, deviations)
    whole = bend.slope * (len(values) - 1 - bend.start)
    changed = bend.deviations > _CLEAR and abs(whole) > least * float(np.abs(values).max())
    way: Way = "steady" if not changed else "grows" if bend.slope > 0.0 else "falls"
    return Change(
        quantity=quantity,
        unit=unit,
        way=way,
        since=logs[bend.start + 1] if changed else None,
        per_run=bend.slope if changed else 0.0,
        deviations=bend.deviations,
        sizes=[_size(*each) for each in zip(logs, values, deviations, strict=True)],
    )


def _size(log: str, value: float, deviation: float) -> Size:
    reach = 1.96 * deviation if np.isfinite(deviation) else None
    return Size(log=log, value=float(value), ci95=None if reach is None else (value - reach, value + reach))


def bent(values: Array, deviations: Array) -> Bend:
    """The line with a bend that fits a quantity best over its runs (R,).

    Deviations that the scatter about it belies are widened to it. Runs of infinite deviation do not count.
    """
    weights = np.where(np.isfinite(deviations), 1.0 / np.maximum(deviations, 1e-300), 0.0)
    if np.count_nonzero(weights) < FEWEST:
        return Bend(0, 0.0, 0.0)
    return min((_from(values, weights, start) for start in range(len(values) - 1)), key=lambda found: found[0])[1]


def _from(values: Array, weights: Array, start: int) -> tuple[float, Bend]:
    """Sum of squared errors of the line that bends at a run, and that line."""
    ramp = np.maximum(np.arange(len(values)) - start, 0.0)
    table = np.column_stack([np.ones(len(values)), ramp])
    found = np.linalg.lstsq(table * weights[:, None], values * weights, rcond=None)[0]
    left = float(np.sum(((values - table @ found) * weights) ** 2))
    inverse = np.linalg.pinv((table * weights[:, None]).T @ (table * weights[:, None]))
    spread = max(left / max(int(np.count_nonzero(weights)) - 2, 1), 1.0)
    deviation = float(np.sqrt(inverse[1, 1] * spread))
    return left, Bend(start, float(found[1]), abs(float(found[1])) / max(deviation, 1e-300))


def explained(changes: Sequence[Change], runs: int) -> str:
    """What changes, for a person."""
    moving = sorted(
        (c for c in changes if c.way != "steady"), key=lambda c: ("." not in c.quantity, -c.deviations)
    )
    if not moving:
        return f"Over {runs} runs nothing grows or falls that stands clear of how well each run knows it."
    said = "; ".join(
        f"{c.quantity} {c.way} by {abs(c.per_run):.3g} {'' if c.unit == '1' else c.unit}".rstrip()
        + f" a run since {c.since} ({c.sizes[0].value:.3g} to {c.sizes[-1].value:.3g})"
        for c in moving
    )
    checks = [
        advice(name) for name in dict.fromkeys(c.quantity.split(".")[0] for c in moving if "." in c.quantity)
    ]
    return f"Over {runs} runs {said}." + (f" Check: {'; '.join(checks)}." if checks else "")

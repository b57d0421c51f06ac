"""Scores of a trial."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from statistics import fmean, median

from sim_rig.effect_forms import FORMS
from sim_rig.trial.cases import GRID_RATIOS
from sim_rig.trial.scoring.trial_report import (
    CalibrationBin,
    CaseResult,
    DetectionBin,
    EffectScore,
    Proportion,
    Scores,
    ShrinkageScore,
)

CALIBRATION_EDGES = (0.0, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0)
"""[1] edges of the bins of the calibration curves."""
_SIZE_EDGES = (1.0, *(math.sqrt(a * b) for a, b in pairwise(GRID_RATIOS)), math.inf)
"""[1] edges of the bins of a detection curve: geometric means of the grid's ratios."""
_Z_95 = 1.959964
"""[1] standard normal quantile of a two-sided 95 % interval."""
_CONFIDENT_PROBABILITY = 0.9
"""[1] probability above which an effect is named with confidence, if its share is large as well."""
_LARGE_SHARE = 0.5
"""[1] share of the gap above which an effect is said to cause most of it."""
_CLOSE_CLAIM = 0.05
"""[1] largest difference between claimed and observed shrinkage that is close without an interval."""
UNKNOWN_LABEL = "(unknown)"
NOTHING_LABEL = "(nothing)"


def compute_scores(cases: Sequence[CaseResult]) -> Scores:
    """Compute all scores; cases recorded again over wires count only in their own group."""
    accelerated = [case for case in cases if not case.wired]
    diagnosed = [case for case in accelerated if case.failure is None]
    nothing = [case for case in diagnosed if case.kind == "nothing"]
    unknown = [case for case in diagnosed if case.kind == "unknown"]
    single = [case for case in diagnosed if len(case.truth) == 1]
    durations = [case.seconds for case in diagnosed]
    groups = group_cases(cases)
    return Scores(
        correct={name: compute_proportion(c.correct for c in group) for name, group in groups.items()},
        correct_or_alternative={
            name: compute_proportion(c.correct_or_alternative for c in group) for name, group in groups.items()
        },
        false_alarms=compute_proportion(bool(_get_names(c)) for c in nothing),
        no_gap_correct=compute_proportion(c.verdict == "no_gap" for c in nothing),
        unknown_correct=compute_proportion(not _get_names(c) for c in unknown),
        unknown_blamed=compute_proportion(_is_blamed(c) for c in unknown),
        stage_correct=compute_proportion(c.stage == _find_stage(c) for c in single),
        failures=len(accelerated) - len(diagnosed),
        log_score=fmean(math.log(c.truth_probability) for c in diagnosed) if diagnosed else None,
        calibration=_bin_named_sets(diagnosed),
        effect_calibration=bin_claims(
            (p, name in c.truth) for c in diagnosed for name, p in c.effect_probabilities.items()
        ),
        shrinkage=_score_shrinkage(diagnosed),
        effects=_score_effects(diagnosed),
        confusion=_count_confusion(diagnosed),
        seconds_median=median(durations) if durations else None,
        seconds_max=max(durations, default=None),
    )


def is_confident(probability: float, share: float) -> bool:
    """Return True if an effect with a probability [1] and a share of the gap [1] is named with confidence."""
    return probability > _CONFIDENT_PROBABILITY and share > _LARGE_SHARE


def _is_blamed(case: CaseResult) -> bool:
    """Return True if a diagnosis attributes an unknown effect to effects of the library with confidence.

    A partial answer with doubtful names is no such claim: it states what helps, and that more is unknown.
    """
    shares = case.effect_shares
    return case.verdict == "explained" or any(
        is_confident(p, shares.get(name, 0.0)) for name, p in case.effect_probabilities.items()
    )


def group_cases(cases: Sequence[CaseResult]) -> dict[str, list[CaseResult]]:
    """Group the cases with library effects by size, method, kind and noise."""
    known = [case for case in cases if case.kind in ("single", "pair", "triple")]
    conditions: dict[str, Callable[[CaseResult], bool]] = {
        "all": lambda case: True,
        "large": lambda case: case.magnitude == "large",
        "small": lambda case: case.magnitude == "small",
        "rich": lambda case: case.method == "rich",
        "poor": lambda case: case.method == "poor",
        "single": lambda case: case.kind == "single",
        "pair": lambda case: case.kind == "pair",
        "triple": lambda case: case.kind == "triple",
        "large rich": lambda case: (case.magnitude, case.method) == ("large", "rich"),
        "small rich": lambda case: (case.magnitude, case.method) == ("small", "rich"),
        "large poor": lambda case: (case.magnitude, case.method) == ("large", "poor"),
        "small poor": lambda case: (case.magnitude, case.method) == ("small", "poor"),
        "coloured noise": lambda case: case.noise == "coloured",
    }
    groups = {
        name: [case for case in known if not case.wired and condition(case)]
        for name, condition in conditions.items()
    }
    return groups | {"over wires": [case for case in known if case.wired]}


def compute_proportion(hits: Iterable[bool]) -> Proportion:
    """Count the hits, with Wilson's 95 % interval of their fraction."""
    listed = list(hits)
    count, total = sum(listed), len(listed)
    if not total:
        return Proportion(count=0, total=0, fraction=None, ci95=None)
    fraction, squared = count / total, _Z_95 * _Z_95 / total
    middle = fraction + squared / 2
    half = _Z_95 * math.sqrt(fraction * (1 - fraction) / total + squared / (4 * total))
    low, high = (middle - half) / (1 + squared), (middle + half) / (1 + squared)
    return Proportion(count=count, total=total, fraction=fraction, ci95=(max(low, 0.0), min(high, 1.0)))


def bin_claims(claims: Iterable[tuple[float, bool]]) -> tuple[CalibrationBin, ...]:
    """Return the calibration curve of claims (probability [1], whether correct); empty bins are left out."""
    listed, bins = list(claims), []
    for low, high in pairwise(CALIBRATION_EDGES):
        inside = [(p, true) for p, true in listed if low <= p < high or (p == high == CALIBRATION_EDGES[-1])]
        if inside:
            predicted, observed = fmean(p for p, _ in inside), fmean(true for _, true in inside)
            bins.append(
                CalibrationBin(low=low, high=high, count=len(inside), predicted=predicted, observed=observed)
            )
    return tuple(bins)


def _bin_named_sets(cases: Sequence[CaseResult]) -> tuple[CalibrationBin, ...]:
    """Return the calibration curve of the named sets; the verdict `unexplained` claims none."""
    named = [(case, case.named_set) for case in cases if case.named_set and case.verdict != "unexplained"]
    return bin_claims((chosen.probability, case.kind != "unknown" and case.correct) for case, chosen in named)


def _get_names(case: CaseResult) -> tuple[str, ...]:
    return case.named_set.effects if case.named_set else ()


def _find_stage(case: CaseResult) -> str:
    return next(form.stage for form in FORMS.values() if form.effect == case.truth[0])


def _score_shrinkage(cases: Sequence[CaseResult]) -> ShrinkageScore:
    candidates = [(c, c.claimed_shrinkage, c.true_shrinkage) for c in cases if _get_names(c)]
    pairs = [(c, claimed, true) for c, claimed, true in candidates if claimed is not None and true is not None]
    claims = [
        (abs(claimed - true), c.claimed_ci95[0] <= true <= c.claimed_ci95[1])
        for c, claimed, true in pairs
        if c.claimed_ci95
    ]
    return ShrinkageScore(
        cases=len(pairs),
        claimed=fmean(claimed for _, claimed, _ in pairs) if pairs else None,
        observed=fmean(true for _, _, true in pairs) if pairs else None,
        median_difference=median(abs(claimed - true) for _, claimed, true in pairs) if pairs else None,
        within_ci95=compute_proportion(within for _, within in claims),
        close_or_within=compute_proportion(within or error <= _CLOSE_CLAIM for error, within in claims),
    )


def _score_effects(cases: Sequence[CaseResult]) -> dict[str, EffectScore]:
    names = sorted({name for case in cases for name in (*case.truth, *_get_names(case))})
    return {name: _score_effect(name, cases) for name in names}


def _score_effect(name: str, cases: Sequence[CaseResult]) -> EffectScore:
    active = [case for case in cases if name in case.truth]
    sizes = [(case.ratios[name], name in _get_names(case)) for case in active]
    detection = []
    for low, high in pairwise(_SIZE_EDGES):
        inside = [detected for ratio, detected in sizes if low <= ratio < high]
        if inside:
            top = min(high, max(ratio for ratio, _ in sizes if ratio < high))
            detection.append(DetectionBin(low=low, high=top, cases=len(inside), detected=sum(inside)))
    return EffectScore(
        cases=len(active),
        detected=sum(detected for _, detected in sizes),
        correct_alone=compute_proportion(case.correct for case in active if len(case.truth) == 1),
        false_alarms=sum(name in _get_names(case) and name not in case.truth for case in cases),
        detection=tuple(detection),
    )


def _count_confusion(cases: Sequence[CaseResult]) -> dict[str, dict[str, int]]:
    pairs = Counter((_label_truth(case), _label_diagnosis(case)) for case in cases)
    table: dict[str, dict[str, int]] = {}
    for (truth, answer), count in sorted(pairs.items()):
        table.setdefault(truth, {})[answer] = count
    return table


def _label_truth(case: CaseResult) -> str:
    label = " + ".join(case.truth) or NOTHING_LABEL
    return f"{label} {UNKNOWN_LABEL}" if case.kind == "unknown" else label


def _label_diagnosis(case: CaseResult) -> str:
    if case.verdict == "unexplained":
        return UNKNOWN_LABEL
    return " + ".join(_get_names(case)) or NOTHING_LABEL

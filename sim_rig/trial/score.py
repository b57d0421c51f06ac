"""The scores of a trial."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from statistics import fmean, median

from sim_rig.scenarios.sealed import FORMS
from sim_rig.trial.answer import Bin, CaseAnswer, EffectScore, Scores, Share, Shrinkage, SizeBin
from sim_rig.trial.draw import GRID

EDGES = (0.0, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0)
"""[1] between the bins of the calibration curves."""
_SIZE_EDGES = (1.0, *(math.sqrt(a * b) for a, b in pairwise(GRID)), math.inf)
_Z = 1.959964
"""[1] deviations of a two-sided 95 % interval."""
UNKNOWN = "(unknown)"
NOTHING = "(nothing)"


def scores(cases: Sequence[CaseAnswer]) -> Scores:
    """All scores of these cases; what was recorded over wires once more counts there alone."""
    once = [case for case in cases if not case.over_wires]
    answered = [case for case in once if case.failure is None]
    nothing = [case for case in answered if case.kind == "nothing"]
    unknown = [case for case in answered if case.kind == "unknown"]
    alone = [case for case in answered if len(case.truth) == 1]
    times = [case.seconds for case in answered]
    return Scores(
        named_first={name: share(c.right for c in group) for name, group in groups(cases).items()},
        among={name: share(c.among for c in group) for name, group in groups(cases).items()},
        false_alarms=share(bool(_names(c)) for c in nothing),
        no_gap_on_nothing=share(c.verdict == "no_gap" for c in nothing),
        unknown_left_unknown=share(not _names(c) for c in unknown),
        stage_right=share(c.stage == _stage_of(c) for c in alone),
        failures=len(once) - len(answered),
        log_score=fmean(math.log(c.probability_of_truth) for c in answered) if answered else None,
        calibration=_first_choices(answered),
        effect_calibration=bins((p, name in c.truth) for c in answered for name, p in c.odds.items()),
        shrinkage=_shrinkage(answered),
        effects=_by_effect(answered),
        confusion=_confusion(answered),
        seconds_median=median(times) if times else None,
        seconds_most=max(times, default=None),
    )


def groups(cases: Sequence[CaseAnswer]) -> dict[str, list[CaseAnswer]]:
    """The cases with effects that the library is to know, by what makes them hard."""
    known = [case for case in cases if case.kind in ("single", "pair", "triple")]
    tests: dict[str, Callable[[CaseAnswer], bool]] = {
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
    found = {name: [case for case in known if not case.over_wires and test(case)] for name, test in tests.items()}
    return found | {"over wires": [case for case in known if case.over_wires]}


def share(hits: Iterable[bool]) -> Share:
    """How many are true, with Wilson's interval."""
    listed = list(hits)
    count, of = sum(listed), len(listed)
    if not of:
        return Share(count=0, of=0, share=None, ci95=None)
    part, squared = count / of, _Z * _Z / of
    middle, half = part + squared / 2, _Z * math.sqrt(part * (1 - part) / of + squared / (4 * of))
    low, high = (middle - half) / (1 + squared), (middle + half) / (1 + squared)
    return Share(count=count, of=of, share=part, ci95=(max(low, 0.0), min(high, 1.0)))


def bins(claims: Iterable[tuple[float, bool]]) -> tuple[Bin, ...]:
    """A calibration curve from claims (probability [1], whether it came true); empty bins are left out."""
    listed, found = list(claims), []
    for low, high in pairwise(EDGES):
        inside = [(p, true) for p, true in listed if low <= p < high or (p == high == EDGES[-1])]
        if inside:
            claimed, came_true = fmean(p for p, _ in inside), fmean(true for _, true in inside)
            found.append(Bin(low=low, high=high, claims=len(inside), claimed=claimed, came_true=came_true))
    return tuple(found)


def _first_choices(cases: Sequence[CaseAnswer]) -> tuple[Bin, ...]:
    """Of the named sets: `unexplained` names none, and makes no such claim."""
    named = [(case, case.named) for case in cases if case.named is not None and case.verdict != "unexplained"]
    return bins((chosen.probability, case.kind != "unknown" and case.right) for case, chosen in named)


def _names(case: CaseAnswer) -> tuple[str, ...]:
    return case.named.effects if case.named else ()


def _stage_of(case: CaseAnswer) -> str:
    return next(form.stage for form in FORMS.values() if form.effect == case.truth[0])


def _shrinkage(cases: Sequence[CaseAnswer]) -> Shrinkage:
    both = [(c, c.claimed_shrinkage, c.true_shrinkage) for c in cases if _names(c)]
    pairs = [(c, claimed, true) for c, claimed, true in both if claimed is not None and true is not None]
    within = [c.claimed_ci95[0] <= true <= c.claimed_ci95[1] for c, _, true in pairs if c.claimed_ci95]
    return Shrinkage(
        cases=len(pairs),
        claimed=fmean(claimed for _, claimed, _ in pairs) if pairs else None,
        true=fmean(true for _, _, true in pairs) if pairs else None,
        median_difference=median(abs(claimed - true) for _, claimed, true in pairs) if pairs else None,
        inside_interval=share(within),
    )


def _by_effect(cases: Sequence[CaseAnswer]) -> dict[str, EffectScore]:
    names = sorted({name for case in cases for name in (*case.truth, *_names(case))})
    return {name: _effect(name, cases) for name in names}


def _effect(name: str, cases: Sequence[CaseAnswer]) -> EffectScore:
    there = [case for case in cases if name in case.truth]
    sizes = [(case.ratios[name], name in _names(case)) for case in there]
    detection = []
    for low, high in pairwise(_SIZE_EDGES):
        inside = [found for ratio, found in sizes if low <= ratio < high]
        if inside:
            top = min(high, max(ratio for ratio, _ in sizes if ratio < high))
            detection.append(SizeBin(low=low, high=top, cases=len(inside), found=sum(inside)))
    return EffectScore(
        cases=len(there),
        found=sum(found for _, found in sizes),
        alone=share(case.right for case in there if len(case.truth) == 1),
        falsely=sum(name in _names(case) and name not in case.truth for case in cases),
        detection=tuple(detection),
    )


def _confusion(cases: Sequence[CaseAnswer]) -> dict[str, dict[str, int]]:
    pairs = Counter((_label_of_truth(case), _label_of_answer(case)) for case in cases)
    table: dict[str, dict[str, int]] = {}
    for (truth, answer), count in sorted(pairs.items()):
        table.setdefault(truth, {})[answer] = count
    return table


def _label_of_truth(case: CaseAnswer) -> str:
    label = " + ".join(case.truth) or NOTHING
    return f"{label} {UNKNOWN}" if case.kind == "unknown" else label


def _label_of_answer(case: CaseAnswer) -> str:
    if case.verdict == "unexplained":
        return UNKNOWN
    return " + ".join(_names(case)) or NOTHING

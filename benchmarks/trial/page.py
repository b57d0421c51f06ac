"""Evidence page of a blind trial.

    python -m benchmarks.trial.page trial.json

The page is written after `mrbench trial`, also after an interrupted one. Cases without a diagnosis are excluded,
and the page states the number of drawn cases. It includes the results of `benchmarks.trial.next_stroke` and
`benchmarks.trial.same_kind` if they exist.
"""

import argparse
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import orjson

from benchmarks.trial.next_stroke import find_open_cases, read_seal, read_second_diagnosis
from benchmarks.trial.same_kind import find_claimed_cases, read_same_kind_shrinkage
from sim_rig.trial.cases import TrialFolder
from sim_rig.trial.execution import DIAGNOSE, WIRES_SUFFIX, TrialOptions
from sim_rig.trial.scoring import (
    CaseResult,
    Proportion,
    Scores,
    TrialReport,
    compute_proportion,
    compute_scores,
    render_table,
    score_trial,
)

EVIDENCE = Path(__file__).parents[2] / "docs" / "evidence"
_CLEAR_GAP = 1.2
"""Threshold on the refitted law's error over the noise floor [1]: above it, a claimed shrinkage is scored."""
_TOLERANCE = 0.05
"""Largest permitted error of a claimed shrinkage [1]."""
_CORRELATION_SUM = 2.63
"""Sum of the squared correlations of neighbouring fourth differences of white noise [1]."""
_PAGE = """# Blind trial of the diagnosis

{run} of {drawn} cases. The truth was drawn and sealed before any recording, with functional forms outside the
library. Each case was diagnosed from its log alone and then unsealed ([method](../explanation/blind-trial.md)).
SHA-256 of the sealed truth: `{seal}`. Commands:

```
{command}
python -m benchmarks.trial.next_stroke trial.json
python -m benchmarks.trial.same_kind trial.json
python -m benchmarks.trial.page trial.json{since}
```

| quantity | requirement | result |
| --- | --- | --- |
{requirements}

Sizes are first-order estimates. The last table contains the actual error of the refitted law on validation strokes
over the noise floor ("before"), and the error with the named effects ("after").

```
{table}```

## Limitations

{limitations}

## Earlier seeds

The results are those of the code at that time. The code was improved with them since, so these seeds are no longer
blind.

{before}

## All cases

A named set in bold is the true one. "p(truth)" is the probability of the true set.
"Shrinkage" is the claimed one / that on the validation run.

| case | kind | strokes | noise | truth (ratio) | verdict | named | p(truth) | before | after | shrinkage | s |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
{rows}
"""

_EARLIER_SEEDS = Path(__file__).with_name("before.md")
"""Results of earlier seeds, each with the code at that time."""


class PageNotes(NamedTuple):
    """Content of the page beyond the document of the trial."""

    next_strokes: Proportion
    """Proposed strokes after which the true set was named."""
    chance: Mapping[str, float]
    """Standard deviation of claimed less true shrinkage that noise alone causes [1], by case."""
    notes: Sequence[str] = ()
    """Further limitations."""
    same_kind: Proportion | None = None
    """Claims of poor methods that hold on another run of the same kind."""
    current_from: str = ""
    """First case with the present way of claiming a shrinkage; earlier claims were used for development."""


def render_page(report: TrialReport, drawn: int, notes: PageNotes) -> str:
    """Return the page of the diagnosed cases, out of the number of drawn cases."""
    diagnosed = [case for case in report.cases if case.verdict or "not been diagnosed" not in (case.failure or "")]
    shown = report.model_copy(update={"cases": tuple(diagnosed), "scores": compute_scores(diagnosed)})
    grid = " --grid" if report.kind == "grid" else ""
    return _PAGE.format(
        run=len([case for case in diagnosed if not case.wired]),
        drawn=drawn,
        seal=report.sealed_sha256,
        command=f"mrbench trial --cases {drawn} --seed {report.seed}{grid} --wired 10 --out trial.json",
        requirements="\n".join(
            f"| {' | '.join(line)} |" for line in _list_requirements(shown.scores, diagnosed, notes)
        ),
        since=notes.current_from and f" --from {notes.current_from}",
        table=render_table(shown),
        limitations="\n".join(f"- {line}" for line in (*_list_limitations(diagnosed, drawn), *notes.notes)),
        before=_EARLIER_SEEDS.read_text(encoding="utf-8").strip(),
        rows="\n".join(map(_render_row, diagnosed)),
    )


def _list_requirements(
    scores: Scores, cases: Sequence[CaseResult], notes: PageNotes
) -> Iterable[tuple[str, str, str]]:
    """List quantity, requirement and result, one line each."""
    known = [case for case in cases if case.kind not in ("nothing", "unknown") and not case.wired]
    later = (
        compute_scores([case for case in cases if case.id >= notes.current_from]) if notes.current_from else None
    )
    for size, required in (("large", "97 %"), ("small", "85 %")):
        yield (
            f"true set named, {size}, rich methods",
            required,
            _format_proportion(scores.correct[f"{size} rich"]),
        )
        if later:
            line = f"of these from {notes.current_from} on, {size}, rich methods"
            yield line, required, _format_proportion(later.correct[f"{size} rich"])
    rich = compute_proportion(case.correct_or_alternative for case in known if case.method == "rich")
    yield "truth is the named set or one of three alternatives, rich methods", "98 %", _format_proportion(rich)
    yield (
        "truth is the named set or one of three alternatives, all methods",
        "98 %",
        _format_proportion(scores.correct_or_alternative["all"]),
    )
    yield "effects named without any effect", "at most 2 in 100", _format_proportion(scores.false_alarms)
    yield (
        "unknown effects not attributed to a library effect",
        "27 of 30",
        _format_proportion(scores.unknown_correct),
    )
    yield "unknown effects blamed on known ones", "at most 5 %", _format_proportion(scores.unknown_blamed)
    yield from _list_claims(cases, notes)
    if notes.same_kind and notes.same_kind.total:
        yield (
            "claimed shrinkage within 5 points on another run of the same kind, poor",
            "–",
            _format_proportion(notes.same_kind),
        )
    yield (
        "truth named after the proposed stroke, poor methods",
        "90 %",
        _format_proportion(notes.next_strokes),
    )
    yield "same diagnosis over the wires", "10 of 10", _format_proportion(_count_same_over_wires(cases))


def _list_claims(cases: Sequence[CaseResult], notes: PageNotes) -> Iterable[tuple[str, str, str]]:
    """List the accuracy of claimed shrinkages; claims used for development have separate lines."""
    claimed, since = (
        f"claimed shrinkage within {100 * _TOLERANCE:.0f} points",
        notes.current_from and f", from {notes.current_from} on",
    )
    current = [case for case in cases if case.id >= notes.current_from]
    for method in ("rich", "poor"):
        yield f"{claimed}, {method}{since}", "95 %", _format_proportion(_count_accurate_claims(current, method))
    for method in ("rich", "poor"):
        near = _count_accurate_claims(current, method, notes.chance)
        yield (
            f"{claimed} or two standard deviations of noise, {method}{since}",
            "–",
            _format_proportion(near),
        )
    for method in ("rich", "poor") if notes.current_from else ():
        earlier = _count_accurate_claims([case for case in cases if case.id < notes.current_from], method)
        yield f"{claimed}, {method}, earlier: used for development", "–", _format_proportion(earlier)


def _list_limitations(cases: Sequence[CaseResult], drawn: int) -> Iterable[str]:
    """List the number of cases that ran, wrong diagnoses, and wrong claims of shrinkage."""
    once = [case for case in cases if not case.wired]
    if len(once) < drawn:
        yield (
            f"**Number of cases.** {len(once)} of the {drawn} sealed cases ran. Kinds, sizes and methods "
            "alternate, so that the first cases are a fair sample. Proportions have Wilson's 95 % interval."
        )
    for case in cases:
        if not case.correct:
            truth = _join_names(case.truth)
            yield f"**{case.id}** ({case.method}, truth {truth}): {_describe_wrong_diagnosis(case)}."
    inaccurate = [
        case
        for case in once
        if case.named_set and case.named_set.effects and _compute_shrinkage_error(case) > _TOLERANCE
    ]
    if inaccurate:
        yield f"**Errors of the shrinkage above {100 * _TOLERANCE:.0f} points**, claimed and true: " + "; ".join(
            f"{case.id} ({case.method}) {case.claimed_shrinkage:.2f} and {case.true_shrinkage:.2f}"
            for case in inaccurate
        )


def _join_names(names: Sequence[str]) -> str:
    return " and ".join(names) or "nothing"


def _describe_wrong_diagnosis(case: CaseResult) -> str:
    """Return the diagnosis that differs from the truth, as text."""
    if case.failure is not None or case.named_set is None:
        return f"no diagnosis, {case.failure}"
    diagnosis = (
        f"{case.verdict}, {_join_names(case.named_set.effects)} named with {case.named_set.probability:.2f}"
    )
    unknown, truth = case.unknown_probability, case.truth_probability
    return f"{diagnosis}, {unknown:.2f} for an unknown effect; {truth:.2f} for the truth"


def _compute_shrinkage_error(case: CaseResult) -> float:
    """Return the error of the claimed shrinkage [1]; 0 if there is no claim or no true value."""
    claimed, true = case.claimed_shrinkage, case.true_shrinkage
    return 0.0 if claimed is None or true is None else abs(claimed - true)


def _format_proportion(found: Proportion) -> str:
    if found.fraction is None or found.ci95 is None:
        return "not measured"
    low, high = found.ci95
    return f"{found.count} of {found.total} = {100 * found.fraction:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def _count_accurate_claims(
    cases: Sequence[CaseResult], method: str, chance: Mapping[str, float] | None = None
) -> Proportion:
    """Count claimed shrinkages that hold on the validation run, of cases with a clear gap and named effects."""
    clear = [
        case
        for case in cases
        if (case.error_ratio_before or 0.0) > _CLEAR_GAP
        and case.named_set
        and case.named_set.effects
        and case.method == method
    ]
    scored = [case for case in clear if None not in (case.claimed_shrinkage, case.true_shrinkage)]
    return compute_proportion(
        _compute_shrinkage_error(case) <= max(_TOLERANCE, 2.0 * (chance or {}).get(case.id, 0.0))
        for case in scored
    )


def _count_same_kind(folder: TrialFolder, cases: Iterable[CaseResult]) -> Proportion:
    """Count claims of poor methods that hold on another run of the same kind, of cases with a clear gap."""
    shrinkages = {case.id: read_same_kind_shrinkage(folder, case) for case in find_claimed_cases(folder)}
    found = [
        case.model_copy(update={"true_shrinkage": shrinkages[case.id]}) for case in cases if case.id in shrinkages
    ]
    return _count_accurate_claims(found, "poor")


def _estimate_chance(folder: TrialFolder, cases: Iterable[CaseResult]) -> dict[str, float]:
    """Estimate the standard deviation of claimed less true shrinkage that white noise causes [1], by case.

    The mean square of N samples of noise has a relative standard deviation of sqrt(2 / N). The noise floor is
    estimated from fourth differences, and neighbouring ones are correlated. Coloured noise is not included.
    """
    found = {}
    for case in cases:
        twin, prediction = (
            _read_document(p)
            for p in (folder.get_case_files(case.id).twin, folder.get_case_files(case.id).prediction)
        )
        if twin and prediction and case.true_shrinkage is not None and case.error_ratio_before:
            noise = twin["sensors"]["force"]["noise"]
            own = sum(one["samples"] for one in twin["baseline"]["per_drive"])
            claimed = 2.0 * (1.0 + _CORRELATION_SUM) / own / (case.error_ratio_before**2 - 1.0) ** 2
            true = 2.0 / prediction["samples"] / ((prediction["before_n"] / noise) ** 2 - 1.0) ** 2
            found[case.id] = math.sqrt(claimed + true)
    return found


def _read_document(path: Path) -> dict[str, Any] | None:
    return dict(orjson.loads(path.read_bytes())) if path.exists() else None


def _count_same_over_wires(cases: Sequence[CaseResult]) -> Proportion:
    """Count cases with the same diagnosis over the wires as in accelerated time."""
    by_name = {case.id: case for case in cases}
    pairs = [(case, by_name[case.id.removesuffix(WIRES_SUFFIX)]) for case in cases if case.wired]
    return compute_proportion(_extract_diagnosis(one) == _extract_diagnosis(other) for one, other in pairs)


def _extract_diagnosis(case: CaseResult) -> tuple[str | None, tuple[str, ...]]:
    return case.verdict, case.named_set.effects if case.named_set else ()


def _count_successful_proposals(folder: TrialFolder) -> Proportion:
    """Count the cases in which the true set was named after the proposed stroke."""
    diagnoses = [(case, read_second_diagnosis(folder, case)) for case, _ in find_open_cases(folder)]
    return compute_proportion(
        found == tuple(sorted(effect.name for effect in case.effects))
        for case, found in diagnoses
        if found is not None
    )


def _render_row(case: CaseResult) -> str:
    truth = ", ".join(f"{name} ({case.ratios[name]:.2f})" for name in case.truth) or "–"
    named = ", ".join(case.named_set.effects) if case.named_set and case.named_set.effects else "–"
    figures = ["–" if f is None else f"{f:.3f}" for f in (case.error_ratio_before, case.error_ratio_after)]
    shrunk = ["–" if f is None else f"{f:.2f}" for f in (case.claimed_shrinkage, case.true_shrinkage)]
    cells = [
        *(case.id, f"{case.kind} {case.magnitude or ''}".strip(), case.method, case.noise, truth),
        *(case.verdict or "none", named if not case.correct else f"**{named}**"),
        *(f"{case.truth_probability:.2f}", *figures, " / ".join(shrunk), f"{case.seconds:.0f}"),
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("trial", type=Path, help="document of `mrbench trial`; its folder is in the same place")
    parser.add_argument("--page", type=Path, default=EVIDENCE / "trial.md", help="page to write")
    parser.add_argument("--note", action="append", default=[], help="further limitation, as text")
    parser.add_argument(
        "--from", dest="current_from", default="", help="first case with the present way of claiming a shrinkage"
    )
    options = parser.parse_args()
    folder = TrialFolder(options.trial)
    seal = read_seal(folder)
    wired = [path.name for path in (folder.root / "diagnoses").glob(f"*{WIRES_SUFFIX}.outcome.json")]
    wires = max((int(name.split("_")[1]) + 1 for name in wired), default=0)
    trial_options = TrialOptions(seal.cases, seal.seed, seal.kind, 1, wires, DIAGNOSE)
    report = score_trial(folder, trial_options)
    notes = PageNotes(
        _count_successful_proposals(folder),
        _estimate_chance(folder, report.cases),
        options.note,
        _count_same_kind(folder, report.cases),
        options.current_from,
    )
    options.page.write_text(render_page(report, seal.cases, notes), encoding="utf-8")


if __name__ == "__main__":
    main()

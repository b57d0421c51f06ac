"""The evidence page of a blind trial: `python -m benchmarks.trial.page trial.json`, after `mrbench trial`.

A trial that was stopped counts as far as it went: cases that have not been diagnosed are left out, and the page
says how many there were to be. Strokes made by `benchmarks.trial.next_stroke` have their line once they are there.
"""

import argparse
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import orjson

from benchmarks.trial.next_stroke import find_open_cases, read_seal, read_second_answer
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
"""[1] refitted law over the floor from which on a shrinkage is asked for."""
_TOLERANCE = 0.05
"""[1] by which a claimed shrinkage may be off."""
_CORRELATION_SUM = 2.63
"""[1] sum of the squared correlations of neighbouring fourth differences of white noise."""
_PAGE = """# The diagnosis on sealed scenarios

{run} of {drawn} cases. Truth drawn and sealed before anything was recorded, in forms of their own; each case
diagnosed from its log alone, then unsealed. [How it works](../explanation/blind-trial.md). Sealed truth: SHA-256
`{seal}`. Made by

```
{command}
python -m benchmarks.trial.next_stroke trial.json
python -m benchmarks.trial.same_kind trial.json
python -m benchmarks.trial.page trial.json{since}
```

| asked | wanted | found |
| --- | --- | --- |
{bars}

Sizes are first-order figures; what the refitted law really left stands in the last table ("before", over the floor
on strokes that no fit saw), and so does what was left with the named effects ("after").

```
{table}```

## Read with care

{care}

## Seeds before

By the code of their day, which has been mended since with what they showed; they are no sealed seeds any more.

{before}

## Case by case

The named set is in bold where it is the true one. "Shrinkage" is claimed / that on the run never seen.

| case | kind | strokes | noise | truth (ratio) | verdict | named | truth had | before | after | shrinkage | s |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |
{rows}
"""

_EARLIER_SEEDS = Path(__file__).with_name("before.md")
"""What earlier seeds came to, each with the code of its day."""


class PageNotes(NamedTuple):
    """What a page tells beside the answer of a trial."""

    next_strokes: Proportion
    """Proposed strokes that brought the truth to the top."""
    chance: Mapping[str, float]
    """[1] by which noise alone moves claimed from true shrinkage, one deviation, case by case."""
    notes: Sequence[str] = ()
    same_kind: Proportion | None = None
    """Claims of poor methods that came true on another run of their kind."""
    current_from: str = ""
    """The first case whose shrinkage was claimed as it is now; claims before were learnt from, and stand apart."""


def render_page(whole: TrialReport, drawn: int, beside: PageNotes) -> str:
    """The page of the cases that have been diagnosed, of so many that were sealed."""
    honest = [case for case in whole.cases if case.verdict or "not been diagnosed" not in (case.failure or "")]
    told = whole.model_copy(update={"cases": tuple(honest), "scores": compute_scores(honest)})
    grid = " --grid" if whole.kind == "grid" else ""
    return _PAGE.format(
        run=len([case for case in honest if not case.wired]),
        drawn=drawn,
        seal=whole.sealed_sha256,
        command=f"mrbench trial --cases {drawn} --seed {whole.seed}{grid} --wired 10 --out trial.json",
        bars="\n".join(f"| {' | '.join(line)} |" for line in _list_requirements(told.scores, honest, beside)),
        since=beside.current_from and f" --from {beside.current_from}",
        table=render_table(told),
        care="\n".join(f"- {line}" for line in (*_list_caveats(honest, drawn), *beside.notes)),
        before=_EARLIER_SEEDS.read_text(encoding="utf-8").strip(),
        rows="\n".join(map(_render_row, honest)),
    )


def _list_requirements(
    found: Scores, cases: Sequence[CaseResult], beside: PageNotes
) -> Iterable[tuple[str, str, str]]:
    """What is asked of the diagnosis, what is wanted, and what was found."""
    known = [case for case in cases if case.kind not in ("nothing", "unknown") and not case.wired]
    later = (
        compute_scores([case for case in cases if case.id >= beside.current_from]) if beside.current_from else None
    )
    for size, wanted in (("large", "97 %"), ("small", "85 %")):
        yield (
            f"right set named first, {size}, rich methods",
            wanted,
            _format_share(found.correct[f"{size} rich"]),
        )
        if later:
            line = f"of these from {beside.current_from} on, {size}, rich methods"
            yield line, wanted, _format_share(later.correct[f"{size} rich"])
    rich = compute_proportion(case.correct_or_alternative for case in known if case.method == "rich")
    yield "truth among the named and three alternatives, rich methods", "98 %", _format_share(rich)
    yield (
        "truth among the named and three alternatives, all methods",
        "98 %",
        _format_share(found.correct_or_alternative["all"]),
    )
    yield "effects named where nothing is", "at most 2 in 100", _format_share(found.false_alarms)
    yield "unknown effects blamed on no known one", "27 of 30", _format_share(found.unknown_correct)
    yield from _list_claims(cases, beside)
    if beside.same_kind and beside.same_kind.total:
        yield (
            "claimed shrinkage within 5 points on another run of its kind, poor",
            "–",
            _format_share(beside.same_kind),
        )
    yield (
        "truth named after the proposed stroke was made, poor methods",
        "90 %",
        _format_share(beside.next_strokes),
    )
    yield "same answer over the wires", "10 of 10", _format_share(_count_same_over_wires(cases))


def _list_claims(cases: Sequence[CaseResult], beside: PageNotes) -> Iterable[tuple[str, str, str]]:
    """How near the claimed shrinkages came, those of now apart from those that were learnt from."""
    claimed, since = (
        f"claimed shrinkage within {100 * _TOLERANCE:.0f} points",
        beside.current_from and f", from {beside.current_from} on",
    )
    now = [case for case in cases if case.id >= beside.current_from]
    for method in ("rich", "poor"):
        yield f"{claimed}, {method}{since}", "95 %", _format_share(_count_accurate_claims(now, method))
    for method in ("rich", "poor"):
        near = _count_accurate_claims(now, method, beside.chance)
        yield (
            f"{claimed} or what noise alone does to it (two deviations), {method}{since}",
            "–",
            _format_share(near),
        )
    for method in ("rich", "poor") if beside.current_from else ():
        learnt = _count_accurate_claims([case for case in cases if case.id < beside.current_from], method)
        yield f"{claimed}, {method}, before that: learnt from", "–", _format_share(learnt)


def _list_caveats(cases: Sequence[CaseResult], drawn: int) -> Iterable[str]:
    """What is behind the figures: how many there are, and every case that went wrong."""
    once = [case for case in cases if not case.wired]
    if len(once) < drawn:
        yield (
            f"**How much ran.** {len(once)} of the {drawn} sealed cases; kinds, sizes and methods come in turn, "
            "so that the beginning is a fair sample. Shares stand with Wilson's 95 % interval."
        )
    for case in cases:
        if not case.correct:
            yield f"**{case.id}** ({case.method}, {_join_names(case.truth)} at work): {_describe_wrong_answer(case)}."
    far = [
        case
        for case in once
        if case.named_set and case.named_set.effects and _compute_shrinkage_error(case) > _TOLERANCE
    ]
    if far:
        yield f"**Shrinkage more than {100 * _TOLERANCE:.0f} points off**, claimed and true: " + "; ".join(
            f"{case.id} ({case.method}) {case.claimed_shrinkage:.2f} and {case.true_shrinkage:.2f}" for case in far
        )


def _join_names(names: Sequence[str]) -> str:
    return " and ".join(names) or "nothing"


def _describe_wrong_answer(case: CaseResult) -> str:
    """What was said instead of the truth."""
    if case.failure is not None or case.named_set is None:
        return f"no diagnosis, {case.failure}"
    said = f"{case.verdict}, {_join_names(case.named_set.effects)} named with {case.named_set.probability:.2f}"
    unknown, truth = case.unknown_probability, case.truth_probability
    return f"{said}, {unknown:.2f} for something unknown; the truth had {truth:.2f}"


def _compute_shrinkage_error(case: CaseResult) -> float:
    """[1] by which the claimed shrinkage was off; 0 where there is none."""
    claimed, true = case.claimed_shrinkage, case.true_shrinkage
    return 0.0 if claimed is None or true is None else abs(claimed - true)


def _format_share(found: Proportion) -> str:
    if found.fraction is None or found.ci95 is None:
        return "not measured"
    low, high = found.ci95
    return f"{found.count} of {found.total} = {100 * found.fraction:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def _count_accurate_claims(
    cases: Sequence[CaseResult], method: str, chance: Mapping[str, float] | None = None
) -> Proportion:
    """Claimed shrinkages that came true on the run never seen, of cases with a clear gap and named effects."""
    clear = [
        case
        for case in cases
        if (case.error_ratio_before or 0.0) > _CLEAR_GAP
        and case.named_set
        and case.named_set.effects
        and case.method == method
    ]
    there = [case for case in clear if None not in (case.claimed_shrinkage, case.true_shrinkage)]
    return compute_proportion(
        _compute_shrinkage_error(case) <= max(_TOLERANCE, 2.0 * (chance or {}).get(case.id, 0.0)) for case in there
    )


def _count_same_kind(folder: TrialFolder, cases: Iterable[CaseResult]) -> Proportion:
    """Claims of poor methods that came true on another run of their kind, of cases with a clear gap."""
    there = {case.id: read_same_kind_shrinkage(folder, case) for case in find_claimed_cases(folder)}
    found = [case.model_copy(update={"true_shrinkage": there[case.id]}) for case in cases if case.id in there]
    return _count_accurate_claims(found, "poor")


def _estimate_chance(folder: TrialFolder, cases: Iterable[CaseResult]) -> dict[str, float]:
    """[1] deviation that white noise gives to claimed less true shrinkage, by the name of the case.

    The mean square of N samples of noise varies by the root of 2 / N of itself. The floor comes from fourth
    differences, neighbours of which are alike. Coloured noise comes on top.
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
    """Cases whose diagnosis over the wires named what that in accelerated time did."""
    by_name = {case.id: case for case in cases}
    twice = [(case, by_name[case.id.removesuffix(WIRES_SUFFIX)]) for case in cases if case.wired]
    return compute_proportion(_extract_answer(one) == _extract_answer(other) for one, other in twice)


def _extract_answer(case: CaseResult) -> tuple[str | None, tuple[str, ...]]:
    return case.verdict, case.named_set.effects if case.named_set else ()


def _count_successful_proposals(folder: TrialFolder) -> Proportion:
    """Cases with open sets in which the proposed stroke brought the truth to the top."""
    answers = [(case, read_second_answer(folder, case)) for case, _ in find_open_cases(folder)]
    return compute_proportion(
        found == tuple(sorted(effect.name for effect in case.effects))
        for case, found in answers
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
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("trial", type=Path, help="the answer of `mrbench trial`; its folder stands beside it")
    options.add_argument("--page", type=Path, default=EVIDENCE / "trial.md")
    options.add_argument("--note", action="append", default=[], help="what else is to be read with care")
    options.add_argument(
        "--from", dest="current_from", default="", help="first case whose shrinkage is claimed as now"
    )
    asked = options.parse_args()
    folder = TrialFolder(asked.trial)
    seal = read_seal(folder)
    twice = [path.name for path in (folder.root / "diagnoses").glob(f"*{WIRES_SUFFIX}.outcome.json")]
    wires = max((int(name.split("_")[1]) + 1 for name in twice), default=0)
    plan = TrialOptions(seal.cases, seal.seed, seal.kind, 1, wires, DIAGNOSE)
    whole = score_trial(folder, plan)
    beside = PageNotes(
        _count_successful_proposals(folder),
        _estimate_chance(folder, whole.cases),
        asked.note,
        _count_same_kind(folder, whole.cases),
        asked.current_from,
    )
    asked.page.write_text(render_page(whole, seal.cases, beside), encoding="utf-8")


if __name__ == "__main__":
    main()

"""The evidence page of a blind trial: `python -m benchmarks.trial trial.json`, after `mrbench trial`.

A trial that was stopped counts as far as it went: cases that have not been diagnosed are left out, and the page
says how many there were to be. Strokes made by `benchmarks.trial_next` have their line once they are there.
"""

import argparse
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import orjson

from benchmarks.trial_alike import claimed_cases, shrunk_there
from benchmarks.trial_next import open_cases, sealed, second_answer
from sim_rig.trial.answer import CaseAnswer, Scores, Share, Trial
from sim_rig.trial.folder import TrialFolder
from sim_rig.trial.run import DIAGNOSE, WIRES, Plan
from sim_rig.trial.score import scores, share
from sim_rig.trial.table import table
from sim_rig.trial.whole import answer

EVIDENCE = Path(__file__).parent.parent / "docs" / "evidence"
_CLEAR = 1.2
"""[1] refitted law over the floor from which on a shrinkage is asked for."""
_WITHIN = 0.05
"""[1] by which a claimed shrinkage may be off."""
_ALIKE = 2.63
"""[1] sum of the squared correlations of neighbouring fourth differences of white noise."""
_PAGE = """# The diagnosis on sealed scenarios

{run} of {drawn} cases. Truth drawn and sealed before anything was recorded, in forms of their own; each case
diagnosed from its log alone, then unsealed. [How it works](../explanation/blind-trial.md). Sealed truth: SHA-256
`{seal}`. Made by

```
{command}
python -m benchmarks.trial_next trial.json
python -m benchmarks.trial_alike trial.json
python -m benchmarks.trial trial.json{since}
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

_BEFORE = Path(__file__).with_name("trial_before.md")
"""What earlier seeds came to, each with the code of its day."""


class Beside(NamedTuple):
    """What a page tells beside the answer of a trial."""

    next_strokes: Share
    """Proposed strokes that brought the truth to the top."""
    chance: Mapping[str, float]
    """[1] by which noise alone moves claimed from true shrinkage, one deviation, case by case."""
    notes: Sequence[str] = ()
    alike: Share | None = None
    """Claims of poor methods that came true on another run of their kind."""
    anew: str = ""
    """The first case whose shrinkage was claimed as it is now; claims before were learnt from, and stand apart."""


def page(whole: Trial, drawn: int, beside: Beside) -> str:
    """The page of the cases that have been diagnosed, of so many that were sealed."""
    honest = [case for case in whole.cases if case.verdict or "not been diagnosed" not in (case.failure or "")]
    told = whole.model_copy(update={"cases": tuple(honest), "scores": scores(honest)})
    grid = " --grid" if whole.draw == "grid" else ""
    return _PAGE.format(
        run=len([case for case in honest if not case.over_wires]),
        drawn=drawn,
        seal=whole.sealed_sha256,
        command=f"mrbench trial --cases {drawn} --seed {whole.seed}{grid} --over-wires 10 --out trial.json",
        bars="\n".join(f"| {' | '.join(line)} |" for line in _bars(told.scores, honest, beside)),
        since=beside.anew and f" --from {beside.anew}",
        table=table(told),
        care="\n".join(f"- {line}" for line in (*_care(honest, drawn), *beside.notes)),
        before=_BEFORE.read_text(encoding="utf-8").strip(),
        rows="\n".join(map(_row, honest)),
    )


def _bars(found: Scores, cases: Sequence[CaseAnswer], beside: Beside) -> Iterable[tuple[str, str, str]]:
    """What is asked of the diagnosis, what is wanted, and what was found."""
    known = [case for case in cases if case.kind not in ("nothing", "unknown") and not case.over_wires]
    later = scores([case for case in cases if case.id >= beside.anew]) if beside.anew else None
    for size, wanted in (("large", "97 %"), ("small", "85 %")):
        yield f"right set named first, {size}, rich methods", wanted, _said(found.named_first[f"{size} rich"])
        if later:
            line = f"of these from {beside.anew} on, {size}, rich methods"
            yield line, wanted, _said(later.named_first[f"{size} rich"])
    rich = share(case.among for case in known if case.method == "rich")
    yield "truth among the named and three alternatives, rich methods", "98 %", _said(rich)
    yield "truth among the named and three alternatives, all methods", "98 %", _said(found.among["all"])
    yield "effects named where nothing is", "at most 2 in 100", _said(found.false_alarms)
    yield "unknown effects blamed on no known one", "27 of 30", _said(found.unknown_left_unknown)
    yield from _claims(cases, beside)
    if beside.alike and beside.alike.of:
        yield "claimed shrinkage within 5 points on another run of its kind, poor", "–", _said(beside.alike)
    yield "truth named after the proposed stroke was made, poor methods", "90 %", _said(beside.next_strokes)
    yield "same answer over the wires", "10 of 10", _said(_same_over_wires(cases))


def _claims(cases: Sequence[CaseAnswer], beside: Beside) -> Iterable[tuple[str, str, str]]:
    """How near the claimed shrinkages came, those of now apart from those that were learnt from."""
    claimed, since = (
        f"claimed shrinkage within {100 * _WITHIN:.0f} points",
        beside.anew and f", from {beside.anew} on",
    )
    now = [case for case in cases if case.id >= beside.anew]
    for method in ("rich", "poor"):
        yield f"{claimed}, {method}{since}", "95 %", _said(_close(now, method))
    for method in ("rich", "poor"):
        near = _close(now, method, beside.chance)
        yield f"{claimed} or what noise alone does to it (two deviations), {method}{since}", "–", _said(near)
    for method in ("rich", "poor") if beside.anew else ():
        learnt = _close([case for case in cases if case.id < beside.anew], method)
        yield f"{claimed}, {method}, before that: learnt from", "–", _said(learnt)


def _care(cases: Sequence[CaseAnswer], drawn: int) -> Iterable[str]:
    """What is behind the figures: how many there are, and every case that went wrong."""
    once = [case for case in cases if not case.over_wires]
    if len(once) < drawn:
        yield (
            f"**How much ran.** {len(once)} of the {drawn} sealed cases; kinds, sizes and methods come in turn, "
            "so that the beginning is a fair sample. Shares stand with Wilson's 95 % interval."
        )
    for case in cases:
        if not case.right:
            yield f"**{case.id}** ({case.method}, {_words(case.truth)} at work): {_wrong(case)}."
    far = [case for case in once if case.named and case.named.effects and _off(case) > _WITHIN]
    if far:
        yield f"**Shrinkage more than {100 * _WITHIN:.0f} points off**, claimed and true: " + "; ".join(
            f"{case.id} ({case.method}) {case.claimed_shrinkage:.2f} and {case.true_shrinkage:.2f}" for case in far
        )


def _words(names: Sequence[str]) -> str:
    return " and ".join(names) or "nothing"


def _wrong(case: CaseAnswer) -> str:
    """What was said instead of the truth."""
    if case.failure is not None or case.named is None:
        return f"no diagnosis, {case.failure}"
    said = f"{case.verdict}, {_words(case.named.effects)} named with {case.named.probability:.2f}"
    unknown, truth = case.unknown_probability, case.probability_of_truth
    return f"{said}, {unknown:.2f} for something unknown; the truth had {truth:.2f}"


def _off(case: CaseAnswer) -> float:
    """[1] by which the claimed shrinkage was off; 0 where there is none."""
    claimed, true = case.claimed_shrinkage, case.true_shrinkage
    return 0.0 if claimed is None or true is None else abs(claimed - true)


def _said(found: Share) -> str:
    if found.share is None or found.ci95 is None:
        return "not measured"
    low, high = found.ci95
    return f"{found.count} of {found.of} = {100 * found.share:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def _close(cases: Sequence[CaseAnswer], method: str, chance: Mapping[str, float] | None = None) -> Share:
    """Claimed shrinkages that came true on the run never seen, of cases with a clear gap and named effects."""
    clear = [
        case
        for case in cases
        if (case.before_over_floor or 0.0) > _CLEAR and case.named and case.named.effects and case.method == method
    ]
    there = [case for case in clear if None not in (case.claimed_shrinkage, case.true_shrinkage)]
    return share(_off(case) <= max(_WITHIN, 2.0 * (chance or {}).get(case.id, 0.0)) for case in there)


def _alike(folder: TrialFolder, cases: Iterable[CaseAnswer]) -> Share:
    """Claims of poor methods that came true on another run of their kind, of cases with a clear gap."""
    there = {case.id: shrunk_there(folder, case) for case in claimed_cases(folder)}
    found = [case.model_copy(update={"true_shrinkage": there[case.id]}) for case in cases if case.id in there]
    return _close(found, "poor")


def _chance(folder: TrialFolder, cases: Iterable[CaseAnswer]) -> dict[str, float]:
    """[1] deviation that white noise gives to claimed less true shrinkage, by the name of the case.

    The mean square of N samples of noise varies by the root of 2 / N of itself. The floor comes from fourth
    differences, neighbours of which are alike. Coloured noise comes on top.
    """
    found = {}
    for case in cases:
        twin, prediction = (_document(p) for p in (folder.files(case.id).twin, folder.files(case.id).prediction))
        if twin and prediction and case.true_shrinkage is not None and case.before_over_floor:
            noise = twin["sensors"]["force"]["noise"]
            own = sum(one["samples"] for one in twin["baseline"]["per_drive"])
            claimed = 2.0 * (1.0 + _ALIKE) / own / (case.before_over_floor**2 - 1.0) ** 2
            true = 2.0 / prediction["samples"] / ((prediction["before_n"] / noise) ** 2 - 1.0) ** 2
            found[case.id] = math.sqrt(claimed + true)
    return found


def _document(path: Path) -> dict[str, Any] | None:
    return dict(orjson.loads(path.read_bytes())) if path.exists() else None


def _same_over_wires(cases: Sequence[CaseAnswer]) -> Share:
    """Cases whose diagnosis over the wires named what that in accelerated time did."""
    by_name = {case.id: case for case in cases}
    twice = [(case, by_name[case.id.removesuffix(WIRES)]) for case in cases if case.over_wires]
    return share(_answer(one) == _answer(other) for one, other in twice)


def _answer(case: CaseAnswer) -> tuple[str | None, tuple[str, ...]]:
    return case.verdict, case.named.effects if case.named else ()


def _came_true(folder: TrialFolder) -> Share:
    """Cases with open sets in which the proposed stroke brought the truth to the top."""
    answers = [(case, second_answer(folder, case)) for case, _ in open_cases(folder)]
    return share(
        found == tuple(sorted(effect.name for effect in case.effects))
        for case, found in answers
        if found is not None
    )


def _row(case: CaseAnswer) -> str:
    truth = ", ".join(f"{name} ({case.ratios[name]:.2f})" for name in case.truth) or "–"
    named = ", ".join(case.named.effects) if case.named and case.named.effects else "–"
    figures = ["–" if f is None else f"{f:.3f}" for f in (case.before_over_floor, case.after_over_floor)]
    shrunk = ["–" if f is None else f"{f:.2f}" for f in (case.claimed_shrinkage, case.true_shrinkage)]
    cells = [
        *(case.id, f"{case.kind} {case.magnitude or ''}".strip(), case.method, case.noise, truth),
        *(case.verdict or "none", named if not case.right else f"**{named}**"),
        *(f"{case.probability_of_truth:.2f}", *figures, " / ".join(shrunk), f"{case.seconds:.0f}"),
    ]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Write the page."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("trial", type=Path, help="the answer of `mrbench trial`; its folder stands beside it")
    options.add_argument("--page", type=Path, default=EVIDENCE / "trial.md")
    options.add_argument("--note", action="append", default=[], help="what else is to be read with care")
    options.add_argument("--from", dest="anew", default="", help="first case whose shrinkage is claimed as now")
    asked = options.parse_args()
    folder = TrialFolder(asked.trial)
    seal = sealed(folder)
    twice = [path.name for path in (folder.root / "diagnoses").glob(f"*{WIRES}.outcome.json")]
    wires = max((int(name.split("_")[1]) + 1 for name in twice), default=0)
    plan = Plan(seal.cases, seal.seed, seal.draw, 1, wires, DIAGNOSE)
    whole = answer(folder, plan)
    beside = Beside(
        _came_true(folder), _chance(folder, whole.cases), asked.note, _alike(folder, whole.cases), asked.anew
    )
    asked.page.write_text(page(whole, seal.cases, beside), encoding="utf-8")


if __name__ == "__main__":
    main()

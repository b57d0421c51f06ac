"""Drawn cases with hidden causes: their outcomes, the table of these, and the options of the command line.

With ``--keep FILE`` each outcome is kept in a file, and a later call of the same code continues the trial.
"""

import argparse
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from benchmarks.common.cache import append_row, read_rows
from benchmarks.common.drawn_table import list_seeds, make_parser
from identification.damper.effects import Stage
from identification.documents import Diagnosis
from identification.errors import IdentificationError
from identification.gap import diagnose
from identification.logs import Recording
from sim_rig.trial.scoring import is_confident

KINDS = ("none", "one", "one", "one", "two", "unknown")
"""Kinds of cases, in turn."""
EFFECT_COUNTS = {"one": 1, "two": 2, "three": 3}
"""Number of effects in each kind of cases with known effects."""
COLUMNS = ("case", "error of the law over the floor", "verdict", "named", "stage", "with them", "right")
SMALLEST_RATIO, LARGE_RATIO = 1.05, 1.5
"""Error of the law over the floor [1]: from the first one an effect counts as small, above the second as large."""
Job: TypeAlias = tuple[int, str]
"""Seed and kind of a case."""


class Case(NamedTuple):
    """A recording and its true cause."""

    recording: Recording
    kind: str
    effects: frozenset[str]
    label: str
    stages: frozenset[Stage]
    """Stages of its cause."""


class Outcome(NamedTuple):
    """Answer to one case."""

    case: str
    kind: str
    truth: frozenset[str]
    named: frozenset[str]
    verdict: str
    stage: str | None
    """Most probable stage."""
    blamed: bool
    """True if an effect that is not at work is named with confidence, or the answer explains an unknown cause."""
    ratio: float
    """Error of the refitted law over the noise floor [1]."""
    after: float
    """Error with the named effects over the noise floor [1]."""
    is_among_four: bool
    stage_right: bool

    @property
    def right(self) -> bool:
        """True if the verdict and the named set are right."""
        if self.kind == "none":
            return self.verdict == "no_gap"
        if self.kind == "unknown":
            return not self.blamed and self.verdict != "refused"
        return self.named == self.truth


def diagnose_case(case: Case) -> Outcome:
    """Diagnose a case and judge the answer; a refused recording is a wrong one."""
    try:
        return judge(case, diagnose([case.recording]).diagnosis)
    except IdentificationError:
        nothing: frozenset[str] = frozenset()
        return Outcome(
            case.label, case.kind, case.effects, nothing, "refused", None, False, math.nan, math.nan, False, False
        )


def judge(case: Case, diagnosis: Diagnosis) -> Outcome:
    """Compare a diagnosis with the truth."""
    named = frozenset(e.name for e in diagnosis.effects)
    confident = {e.name for e in diagnosis.effects if is_confident(e.probability, e.share)}
    explained_unknown = case.kind == "unknown" and diagnosis.verdict == "explained"
    sets = [named, *(frozenset(a.effects) for a in diagnosis.alternatives)]
    return Outcome(
        case.label, case.kind, case.effects, named, diagnosis.verdict, diagnosis.where.stage,
        bool(confident - case.effects) or explained_unknown,
        diagnosis.gap.before_n / diagnosis.gap.noise_floor_n, diagnosis.gap.after_n / diagnosis.gap.noise_floor_n,
        case.effects in sets, not case.stages or diagnosis.where.stage in case.stages,
    )  # fmt: skip


def continue_trial(
    jobs: Sequence[Job], path: Path | None, run: Callable[[Sequence[Job]], Iterable[Outcome]]
) -> Iterator[Outcome]:
    """Yield the outcomes of jobs in their order: those in a file first, then the others, which are added to it.

    Args:
        jobs: seed and kind of each case.
        path: file with a line of JSON for each outcome; None for no file.
        run: tries jobs, and returns their outcomes in the same order.
    """
    kept = [_parse(row) for row in read_rows(path)][: len(jobs)]
    yield from kept
    for outcome in run(jobs[len(kept) :]):
        append_row(path, {**outcome._asdict(), "truth": sorted(outcome.truth), "named": sorted(outcome.named)})
        yield outcome


def _parse(row: dict[str, Any]) -> Outcome:
    return Outcome(**{**row, "truth": frozenset(row["truth"]), "named": frozenset(row["named"])})


def format_summary(outcomes: Sequence[Outcome]) -> list[str]:
    """Return the table of right answers by kind."""
    known = [o for o in outcomes if o.kind in EFFECT_COUNTS]
    groups = {
        "no effect": [o for o in outcomes if o.kind == "none"],
        "one effect": [o for o in outcomes if o.kind == "one"],
        "two effects": [o for o in outcomes if o.kind == "two"],
        "three effects": [o for o in outcomes if o.kind == "three"],
        "unknown cause": [o for o in outcomes if o.kind == "unknown"],
        "effects, 1.05 to 1.5 times the floor": [o for o in known if SMALLEST_RATIO <= o.ratio <= LARGE_RATIO],
        "effects, above": [o for o in known if o.ratio > LARGE_RATIO],
    }
    lines = [
        "| recordings | right | true set among four | right stage | blamed |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, rows in groups.items():
        if rows:
            counts = (
                sum(getattr(o, f) for o in rows) for f in ("right", "is_among_four", "stage_right", "blamed")
            )
            lines.append(f"| {name} | " + " | ".join(f"{c} of {len(rows)}" for c in counts) + " |")
    return lines


def format_row(o: Outcome) -> str:
    """Return one case as a row."""
    named = " and ".join(sorted(o.named)) or "-"
    stage = (o.stage or "-") + ("" if o.stage_right else " (**no**)")
    return (
        f"| {o.case} | {o.ratio:.2f} | {o.verdict} | {named} | {stage} | {o.after:.2f} "
        f"| {'yes' if o.right else '**no**'} |"
    )


def read_options(
    description: str | None, count: int, methods: Sequence[str] = ()
) -> tuple[argparse.Namespace, list[tuple[int, str]]]:
    """Return the options of the command line, and the seed and kind of each case.

    Args:
        description: text of the help.
        count: usual number of cases.
        methods: usual methods, as often as they are drawn; no option for them if empty.
    """
    parser = make_parser(description, "recordings", count)
    parser.add_argument("--keep", type=Path, help="file that keeps the outcomes, so that a trial can be continued")
    parser.add_argument("--kinds", default=",".join(KINDS), help="kinds of cases, in turn")
    if methods:
        parser.add_argument("--methods", default=",".join(methods), help="methods to draw from, equally often")
    options = parser.parse_args()
    return options, list(zip(list_seeds(options), cycle(options.kinds.split(",")), strict=False))

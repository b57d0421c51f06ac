"""Discoveries on dampers of any size: a library effect that is withheld, an unknown cause, or nothing.

    python -m benchmarks.accuracy.discovery [--recordings 40] [--seed 1] [--out PAGE.md]

A library effect is withheld from the diagnosis, and drawn in a form of its class. The answer then has to have its
place and variable, and to close the gap on held-out strokes. It is the discovered cause, or without one the named
effect with the largest share: the library may have another effect at the same place over the same variable.
"""

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import NamedTuple

from benchmarks.accuracy.drawn_effects import draw_case
from benchmarks.common.drawn_cases import Case
from benchmarks.common.drawn_table import list_seeds, make_parser, run_trial
from identification.damper.effects import EFFECTS, Place, Variable
from identification.documents import Diagnosis
from identification.gap import diagnose

KINDS = ("one", "unknown", "one", "unknown", "none")
"""Kinds of cases, in turn."""
_UNKNOWN: dict[str, tuple[Place, Variable]] = {
    "gain over displacement": ("damper_gain", "displacement"),
    "drive over time": ("drive", "time"),
    "load cell over force": ("force_channel", "force"),
    "delay over time": ("displacement_channel", "time"),
}
_SAME_PLACE = {"field": "drive"}
"""Before and behind the lag of the coil, which only its transients tell apart."""
_CLOSED = 0.8
"""Part of the gap that a discovery should close."""
COLUMNS = ("case", "error of the law over the floor", "verdict", "found", "formula", "closed", "right")
_VISIBLE = 1.05
"""Smallest error of the law alone over the noise floor at which there is something to find."""


class Answer(NamedTuple):
    """Place and variable of the cause that a diagnosis reports."""

    place: str
    variable: str
    text: str


_NO_ANSWER = Answer("", "", "-")


class Outcome(NamedTuple):
    """Answer to one case."""

    case: str
    kind: str
    verdict: str
    ratio: float
    """Error of the refitted law over the noise floor [1]."""
    answer: str
    """Place and variables that were found."""
    formula: str
    place_right: bool
    variable_right: bool
    closed: float | None
    """Part of the gap that is closed on held-out strokes [1]."""


def try_case(job: tuple[int, int]) -> Outcome:
    """Draw, record and diagnose one case, its effect withheld from the library."""
    seed, number = job
    case = draw_case(seed, KINDS[number % len(KINDS)])
    library = {name: effect for name, effect in EFFECTS.items() if name not in case.effects}
    diagnosis = diagnose([case.recording], library=library, discover=True).diagnosis
    return judge(case, diagnosis)


def judge(case: Case, diagnosis: Diagnosis) -> Outcome:
    """Compare a discovery with the truth."""
    found, gap = diagnosis.discovery, diagnosis.gap
    place, variable = find_truth(case)
    answer, closed = _describe_answer(diagnosis), None
    if answer != _NO_ANSWER:
        after = gap.after_n if found is None else found.rmse_n
        closed = 1.0 - (after**2 - gap.noise_floor_n**2) / (gap.before_n**2 - gap.noise_floor_n**2)
    return Outcome(
        case.label,
        case.kind,
        diagnosis.verdict,
        gap.before_n / gap.noise_floor_n,
        answer.text,
        "-" if found is None or found.formula is None else found.formula.expression,
        _SAME_PLACE.get(answer.place, answer.place) == _SAME_PLACE.get(place, place),
        answer.variable == variable,
        closed,
    )


def _describe_answer(diagnosis: Diagnosis) -> Answer:
    """Return the discovered cause, or else the named effect with the largest share."""
    found = diagnosis.discovery
    if found is not None:
        return Answer(found.place, found.variables[0], f"{found.place} over {', '.join(found.variables)}")
    if not diagnosis.effects:
        return _NO_ANSWER
    first = max(diagnosis.effects, key=lambda effect: effect.share)
    return Answer(
        first.place or "", first.variable or "", f"named: {' and '.join(e.name for e in diagnosis.effects)}"
    )


def find_truth(case: Case) -> tuple[Place, Variable]:
    """Return place and variable of the cause of a case."""
    for name in case.effects:
        return EFFECTS[name].forms[0].place, EFFECTS[name].variable
    return next((truth for cause, truth in _UNKNOWN.items() if cause in case.label), ("damper_gain", "time"))


def format_summary(outcomes: Sequence[Outcome]) -> list[str]:
    """Return the table of right answers by kind; causes that the refitted law hides are counted apart."""
    lines = ["| recordings | place | place and variable | 80 % closed |", "| --- | --- | --- | --- |"]
    for kind, name in (("one", "withheld library effect"), ("unknown", "unknown cause")):
        rows = [o for o in outcomes if o.kind == kind and o.ratio > _VISIBLE]
        if rows:
            place = sum(o.place_right for o in rows)
            both = sum(o.place_right and o.variable_right for o in rows)
            closed = sum(o.closed is not None and o.closed > _CLOSED for o in rows)
            lines.append(f"| {name} | {place} of {len(rows)} | {both} of {len(rows)} | {closed} of {len(rows)} |")
    nulls = [o for o in outcomes if o.kind == "none"]
    hidden = sum(o.kind != "none" and o.ratio <= _VISIBLE for o in outcomes)
    lines += [
        "",
        f"Recordings without an effect, nothing found: {sum(o.answer == '-' for o in nulls)} of {len(nulls)}. "
        f"Causes hidden by the refitted law (below {_VISIBLE} times the floor): {hidden}.",
    ]
    return lines


def format_row(o: Outcome) -> str:
    """Return one case as a row."""
    right = "yes" if o.place_right and o.variable_right else "**no**"
    right = "-" if o.kind == "none" or o.ratio <= _VISIBLE else right
    closed = "-" if o.closed is None else f"{o.closed:.0%}"
    return f"| {o.case} | {o.ratio:.2f} | {o.verdict} | {o.answer} | `{o.formula}` | {closed} | {right} |"


def main() -> None:
    """Print every case and the summary; also write them to a page."""
    options = make_parser(__doc__, "recordings", 40).parse_args()
    jobs = [(seed, n) for n, seed in enumerate(list_seeds(options))]
    with ProcessPoolExecutor(options.jobs) as pool:
        run_trial(COLUMNS, pool.map(try_case, jobs), format_row, format_summary, options.out)


if __name__ == "__main__":
    main()

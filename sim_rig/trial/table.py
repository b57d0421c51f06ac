"""The scores as text for a terminal."""

from collections.abc import Iterable, Sequence
from statistics import median

from sim_rig.trial.answer import Bin, Share, Trial


def table(trial: Trial) -> str:
    """The scores of a trial, a line each."""
    s = trial.scores
    wires = sum(case.over_wires for case in trial.cases)
    again = f" and {wires} of them once more over wires" if wires else ""
    lines = [
        f"{len(trial.cases) - wires} cases{again}, seed {trial.seed}, sealed {trial.sealed_sha256[:16]}...",
        "",
    ]
    lines += ["right set named first / among the alternatives too"]
    rows = [(name, _share(first), _share(s.among[name])) for name, first in s.named_first.items() if first.of]
    lines += _columns(rows)
    lines += ["", *_columns(_single_figures(trial)), ""]
    lines += ["effect: cases, found, alone and named alone, named where it is not"]
    lines += _columns(
        (name, str(e.cases), str(e.found), _share(e.alone), str(e.falsely)) for name, e in s.effects.items()
    )
    lines += ["", "named over size (refitted law over floor): found/cases"]
    lines += _columns(
        (name, *(f"{b.low:.2f}-{b.high:.2f}: {b.found}/{b.cases}" for b in e.detection))
        for name, e in s.effects.items()
        if e.detection
    )
    lines += ["", "calibration of the first choice", *_columns(map(_bin, s.calibration))]
    lines += ["", "calibration of each named effect", *_columns(map(_bin, s.effect_calibration))]
    lines += ["", "named otherwise", *_columns(_misses(trial))]
    return "\n".join(lines) + "\n"


def _single_figures(trial: Trial) -> list[tuple[str, str]]:
    s = trial.scores
    shrinkage = s.shrinkage
    return [
        ("false alarms where nothing is", _share(s.false_alarms)),
        ("no_gap where nothing is", _share(s.no_gap_on_nothing)),
        ("unknown ones left unknown", _share(s.unknown_left_unknown)),
        ("likeliest stage right", _share(s.stage_right)),
        ("without a diagnosis", str(s.failures)),
        ("mean ln probability of the truth", _number(s.log_score)),
        ("refitted law over floor, small", _number(_before(trial, "small"))),
        ("refitted law over floor, large", _number(_before(trial, "large"))),
        ("shrinkage claimed / true", f"{_number(shrinkage.claimed)} / {_number(shrinkage.true)}"),
        ("  median difference", f"{_number(shrinkage.median_difference)} in {shrinkage.cases} cases"),
        ("  true within the interval", _share(shrinkage.inside_interval)),
        ("a diagnosis [s], median / longest", f"{_number(s.seconds_median)} / {_number(s.seconds_most)}"),
    ]


def _before(trial: Trial, magnitude: str) -> float | None:
    """Median of what the diagnoses measured [1]."""
    found = [c.before_over_floor for c in trial.cases if c.magnitude == magnitude and c.before_over_floor]
    return median(found) if found else None


def _misses(trial: Trial) -> list[tuple[str, str, str]]:
    return [
        (truth, answer, str(count))
        for truth, answers in trial.scores.confusion.items()
        for answer, count in answers.items()
        if truth != answer and not truth.endswith(answer)
    ]


def _share(found: Share) -> str:
    if found.share is None or found.ci95 is None:
        return "-"
    low, high = found.ci95
    return f"{found.count}/{found.of} = {100 * found.share:.0f} % ({100 * low:.0f} to {100 * high:.0f})"


def _bin(found: Bin) -> tuple[str, str, str]:
    return (
        f"{found.low:.2f} to {found.high:.2f}",
        f"claimed {found.claimed:.2f}, came true {found.came_true:.2f}",
        f"{found.claims} claims",
    )


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _columns(rows: Iterable[Sequence[str]]) -> list[str]:
    """Rows of texts in columns that are as wide as their widest."""
    listed = [tuple(row) for row in rows]
    count = max((len(row) for row in listed), default=0)
    widths = [max((len(row[place]) for row in listed if place < len(row)), default=0) for place in range(count)]
    return [
        "  " + "   ".join(text.ljust(width) for text, width in zip(row, widths, strict=False)).rstrip()
        for row in listed
    ]

"""Scores of a trial as text for a terminal."""

from collections.abc import Iterable, Sequence
from statistics import median

from sim_rig.trial.scoring.trial_report import CalibrationBin, Proportion, TrialReport


def render_table(trial: TrialReport) -> str:
    """Return the scores of a trial as lines of text."""
    s = trial.scores
    wired = sum(case.wired for case in trial.cases)
    again = f" and {wired} of them again over wires" if wired else ""
    lines = [
        f"{len(trial.cases) - wired} cases{again}, seed {trial.seed}, sealed {trial.sealed_sha256[:16]}...",
        "",
    ]
    lines += ["true set named / named or an alternative"]
    rows = [
        (name, _format_proportion(correct), _format_proportion(s.correct_or_alternative[name]))
        for name, correct in s.correct.items()
        if correct.total
    ]
    lines += _format_columns(rows)
    lines += ["", *_format_columns(_list_figures(trial)), ""]
    lines += ["effect: cases, detected, alone and correct, false alarms"]
    lines += _format_columns(
        (name, str(e.cases), str(e.detected), _format_proportion(e.correct_alone), str(e.false_alarms))
        for name, e in s.effects.items()
    )
    lines += ["", "detection by size (error of the refitted law over the noise floor): detected/cases"]
    lines += _format_columns(
        (name, *(f"{b.low:.2f}-{b.high:.2f}: {b.detected}/{b.cases}" for b in e.detection))
        for name, e in s.effects.items()
        if e.detection
    )
    lines += ["", "calibration of the named set", *_format_columns(map(_format_bin, s.calibration))]
    lines += ["", "calibration of each named effect", *_format_columns(map(_format_bin, s.effect_calibration))]
    lines += ["", "named another set", *_format_columns(_list_misses(trial))]
    return "\n".join(lines) + "\n"


def _list_figures(trial: TrialReport) -> list[tuple[str, str]]:
    s = trial.scores
    shrinkage = s.shrinkage
    return [
        ("effects named without any effect", _format_proportion(s.false_alarms)),
        ("no_gap without any effect", _format_proportion(s.no_gap_correct)),
        ("unknown effects left unknown", _format_proportion(s.unknown_correct)),
        ("unknown effects blamed on known ones", _format_proportion(s.unknown_blamed)),
        ("most probable stage correct", _format_proportion(s.stage_correct)),
        ("without a diagnosis", str(s.failures)),
        ("mean ln probability of the truth", _format_number(s.log_score)),
        ("refitted law over noise floor, small", _format_number(_compute_median_ratio(trial, "small"))),
        ("refitted law over noise floor, large", _format_number(_compute_median_ratio(trial, "large"))),
        (
            "shrinkage claimed / observed",
            f"{_format_number(shrinkage.claimed)} / {_format_number(shrinkage.observed)}",
        ),
        ("  median difference", f"{_format_number(shrinkage.median_difference)} in {shrinkage.cases} cases"),
        ("  observed within the interval", _format_proportion(shrinkage.within_ci95)),
        ("  within 5 points or the interval", _format_proportion(shrinkage.close_or_within)),
        (
            "duration of a diagnosis [s], median / longest",
            f"{_format_number(s.seconds_median)} / {_format_number(s.seconds_max)}",
        ),
    ]


def _compute_median_ratio(trial: TrialReport, magnitude: str) -> float | None:
    """Return the median of the ratios [1] that the diagnoses measured."""
    ratios = [c.error_ratio_before for c in trial.cases if c.magnitude == magnitude and c.error_ratio_before]
    return median(ratios) if ratios else None


def _list_misses(trial: TrialReport) -> list[tuple[str, str, str]]:
    return [
        (truth, named, str(count))
        for truth, named_sets in trial.scores.confusion.items()
        for named, count in named_sets.items()
        if truth != named and not truth.endswith(named)
    ]


def _format_proportion(proportion: Proportion) -> str:
    if proportion.fraction is None or proportion.ci95 is None:
        return "-"
    low, high = proportion.ci95
    percent = f"{100 * proportion.fraction:.0f} % ({100 * low:.0f} to {100 * high:.0f})"
    return f"{proportion.count}/{proportion.total} = {percent}"


def _format_bin(calibration: CalibrationBin) -> tuple[str, str, str]:
    return (
        f"{calibration.low:.2f} to {calibration.high:.2f}",
        f"predicted {calibration.predicted:.2f}, observed {calibration.observed:.2f}",
        f"{calibration.count} claims",
    )


def _format_number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _format_columns(rows: Iterable[Sequence[str]]) -> list[str]:
    """Align rows of texts in columns."""
    listed = [tuple(row) for row in rows]
    count = max((len(row) for row in listed), default=0)
    widths = [max((len(row[i]) for row in listed if i < len(row)), default=0) for i in range(count)]
    return [
        "  " + "   ".join(text.ljust(width) for text, width in zip(row, widths, strict=False)).rstrip()
        for row in listed
    ]

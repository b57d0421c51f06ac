"""Truth of a simulated damper with a hidden effect, compared with the diagnosis that did not know it."""

from pathlib import Path
from typing import Literal, NamedTuple

from pydantic import Field

from bench.report.diagnosis import VERDICTS, Diagnosis, PropertyRows, join_names
from bench.report.documents import DocumentPart, Prediction, read_document
from bench.report.values import format_force, format_name, format_percent, format_quantity, format_share

_NEAR_FLOOR_RATIO = 1.02
"""Force error over the noise floor, below which there is no gap to close."""


class TrueParameter(DocumentPart):
    """One parameter of the true effect."""

    value: float
    unit: str


class Truth(DocumentPart):
    """Part of a truth file that a report shows."""

    schema_: Literal["mrbench.truth/1"] = Field(alias="schema")
    seed: int
    effect: str
    meaning: str
    stage: str
    form: str
    parameters: dict[str, TrueParameter]


class Judgement(NamedTuple):
    """Comparison of the named effects with the true one."""

    severity: Literal["good", "warning"]
    text: str


def read_truth(path: Path) -> Truth:
    """Read the truth of a drawn damper from its file.

    Raises:
        ReportError: the file cannot be read or is not a truth file.
    """
    return read_document(path, Truth, "the truth file of `mrbench sim --draw SEED --truth FILE`")


def judge(diagnosis: Diagnosis, truth: Truth) -> Judgement:
    """Compare the named effects with the true one."""
    named, true = [effect.name for effect in diagnosis.effects], format_name(truth.effect)
    if named == [truth.effect]:
        return Judgement("good", f"The named effect is the true one: {true}.")
    if truth.effect in named:
        others = join_names([name for name in named if name != truth.effect])
        return Judgement("warning", f"Partly right: {true} is true, but {others} is not part of this damper.")
    answer = f"it named {join_names(named)}" if named else "it named no effect"
    return Judgement("warning", f"Wrong: {answer}, and the true effect is {true}. {_rank_truth(diagnosis, truth)}")


def _rank_truth(diagnosis: Diagnosis, truth: Truth) -> str:
    """Return the place that the true effect has among the alternatives."""
    for other in diagnosis.alternatives:
        if other.effects == [truth.effect]:
            return f"Among its alternatives, the true effect has {format_percent(other.probability)}."
    return "It is not among the alternatives."


def make_answer_rows(diagnosis: Diagnosis, unseen: Prediction | None) -> PropertyRows:
    """Return the answer of a diagnosis as rows: names, gap, and the twin on a recording that no fit has read."""
    rows: PropertyRows = [("Named effect", _describe_names(diagnosis))]
    gap = diagnosis.gap
    if diagnosis.effects:
        closed = None if gap.shrinkage is None else format_share(gap.shrinkage, gap.shrinkage_ci95)
        errors = _describe_errors(gap.before_n, gap.after_n, gap.noise_floor_n, closed)
        rows.append(("Held-out strokes, as expected", errors))
    if unseen is not None:
        rows.append(("Second recording, measured", _describe_unseen(unseen)))
    return rows


def make_truth_rows(truth: Truth) -> PropertyRows:
    """Return the true effect as rows."""
    values = [
        f"{format_name(symbol)} {format_quantity(parameter.value, None, parameter.unit)}"
        for symbol, parameter in truth.parameters.items()
    ]
    return [
        ("True effect", f"{format_name(truth.effect)} ({format_name(truth.stage)}): {truth.meaning}"),
        ("Its form on the rig", f"{format_name(truth.form)}: {', '.join(values)}"),
        ("Drawn by seed", str(truth.seed)),
    ]


def _describe_names(diagnosis: Diagnosis) -> str:
    if not diagnosis.effects:
        return VERDICTS[diagnosis.verdict]
    names = " and ".join(f"{format_name(e.name)} ({format_name(e.stage)})" for e in diagnosis.effects)
    return f"{names}, probability {format_percent(diagnosis.probability)}"


def _describe_unseen(unseen: Prediction) -> str:
    """Describe the errors of the law alone and of the twin on one recording, without a learned residual."""
    floor = unseen.noise_floor_n
    twin = unseen.rmse_n if unseen.physics is None else unseen.physics.rmse_n
    if unseen.before_n is None:
        return f"law alone {format_force(twin)}, noise floor {format_force(floor)}; the twin has no effect"
    if unseen.before_n < _NEAR_FLOOR_RATIO * floor:
        return f"{_describe_errors(unseen.before_n, twin, floor)}; the law alone has no gap there"
    closed = 1.0 - (twin**2 - floor**2) / (unseen.before_n**2 - floor**2)
    return _describe_errors(unseen.before_n, twin, floor, format_percent(closed))


def _describe_errors(before: float, after: float, floor: float, closed: str | None = None) -> str:
    errors = f"law alone {format_force(before)}, twin {format_force(after)}, noise floor {format_force(floor)}"
    return errors if closed is None else f"{errors}; the gap shrinks by {closed}"

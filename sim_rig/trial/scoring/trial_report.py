"""Result of a trial, `mrbench.trial/1`: every case with its truth and its diagnosis, and the scores.

Files of earlier versions stay readable: each renamed field accepts its former name.
"""

from typing import Any, Literal

from pydantic import AliasChoices, Field

from sim_rig.trial.cases import CaseKind, Magnitude, MethodKind, TrialKind
from sim_rig.validation import FrozenModel


def _renamed(name: str, former: str, description: str, **options: Any) -> Any:
    """Return a field that is written under its name and also read under its former name."""
    return Field(validation_alias=AliasChoices(name, former), description=description, **options)


class Proportion(FrozenModel):
    """Count out of a total."""

    count: int = Field(description="number of hits")
    total: int = _renamed("total", "of", "number of cases")
    fraction: float | None = _renamed("fraction", "share", "[1] count over total; null if the total is 0")
    ci95: tuple[float, float] | None = Field(description="[1] 95 % interval (Wilson); null if the total is 0")


NOT_COUNTED = Proportion(count=0, total=0, fraction=None, ci95=None)
"""Default of scores that earlier versions did not have."""


class NamedSet(FrozenModel):
    """A set of effects with its probability."""

    effects: tuple[str, ...] = Field(description="names, sorted; empty for none")
    probability: float = Field(description="[1] of exactly this set")


class CaseResult(FrozenModel):
    """One case, unsealed."""

    id: str = Field(description="name of the case")
    kind: CaseKind = Field(description="number of effects, and whether the library has them")
    magnitude: Magnitude | None = Field(description="size of its effects; null without effects")
    method: MethodKind = Field(description="rich or poor")
    damper: str = Field(description="small, middle or large")
    noise: str = Field(description="white or coloured")
    wired: bool = _renamed("wired", "over_wires", "whether it was recorded over wires")
    truth: tuple[str, ...] = Field(description="names of the active effects, sorted")
    ratios: dict[str, float] = Field(
        description="[1] error of the refitted law over the noise floor if each effect were alone"
    )
    failure: str | None = Field(description="reason if there is no diagnosis")
    seconds: float = Field(description="[s] duration of the diagnosis")
    verdict: str | None = Field(default=None, description="verdict of the diagnosis")
    named_set: NamedSet | None = _renamed("named_set", "named", "most probable set", default=None)
    alternatives: tuple[NamedSet, ...] = Field(default=(), description="at most three other sets")
    unknown_probability: float = Field(default=0.0, description="[1] that an unknown effect is active")
    effect_probabilities: dict[str, float] = _renamed(
        "effect_probabilities", "odds", "[1] of each named effect, that it is active", default={}
    )
    effect_shares: dict[str, float] = Field(
        default={}, description="[1] part of the gap that each named effect closes"
    )
    stage: str | None = Field(default=None, description="most probable stage")
    error_ratio_before: float | None = _renamed(
        "error_ratio_before",
        "before_over_floor",
        "[1] error of the refitted law over the noise floor, on held-out strokes",
        default=None,
    )
    error_ratio_after: float | None = _renamed(
        "error_ratio_after", "after_over_floor", "[1] the same ratio with the named effects", default=None
    )
    claimed_shrinkage: float | None = Field(
        default=None, description="[1] shrinkage by the diagnosis, on held-out strokes"
    )
    claimed_ci95: tuple[float, float] | None = Field(default=None, description="[1] its 95 % interval")
    true_shrinkage: float | None = Field(default=None, description="[1] shrinkage of the twin on a validation run")
    correct: bool = _renamed(
        "correct",
        "right",
        "the true set is named: no effect without effects, none but a gap for an unknown effect",
    )
    correct_or_alternative: bool = _renamed(
        "correct_or_alternative", "among", "the true set is the named set or an alternative"
    )
    truth_probability: float = _renamed(
        "truth_probability", "probability_of_truth", "[1] probability of the true set by the diagnosis"
    )


class CalibrationBin(FrozenModel):
    """Claims of nearly the same probability."""

    low: float = Field(description="[1] lower edge of the probability")
    high: float = Field(description="[1] upper edge of the probability")
    count: int = _renamed("count", "claims", "number of claims")
    predicted: float = _renamed("predicted", "claimed", "[1] mean of the claimed probabilities")
    observed: float = _renamed("observed", "came_true", "[1] part of the claims that were correct")


class ShrinkageScore(FrozenModel):
    """Claimed against observed shrinkage."""

    cases: int = Field(description="number of cases with both")
    claimed: float | None = Field(description="[1] mean of the claimed shrinkage")
    observed: float | None = _renamed("observed", "true", "[1] mean of the observed shrinkage")
    median_difference: float | None = Field(description="[1] median of the absolute difference")
    within_ci95: Proportion = _renamed(
        "within_ci95", "inside_interval", "observed value within the claimed 95 % interval"
    )
    close_or_within: Proportion = Field(
        default=NOT_COUNTED, description="observed value within 5 points of the claim, or within its interval"
    )


class DetectionBin(FrozenModel):
    """Cases in which an effect has nearly the same size."""

    low: float = Field(description="[1] lower edge of the ratio")
    high: float = Field(description="[1] upper edge of the ratio")
    cases: int = Field(description="number of cases")
    detected: int = _renamed("detected", "found", "number of cases in which it was named")


class EffectScore(FrozenModel):
    """Score of one effect."""

    cases: int = Field(description="number of cases in which it is active")
    detected: int = _renamed("detected", "found", "number of these cases in which it was named")
    correct_alone: Proportion = _renamed(
        "correct_alone", "alone", "cases with this effect alone in which it alone was named"
    )
    false_alarms: int = _renamed("false_alarms", "falsely", "number of cases without it in which it was named")
    detection: tuple[DetectionBin, ...] = Field(description="detection by size")


class Scores(FrozenModel):
    """Scores of the diagnosis in a trial."""

    correct: dict[str, Proportion] = _renamed("correct", "named_first", "the true set is named, by group of cases")
    correct_or_alternative: dict[str, Proportion] = _renamed(
        "correct_or_alternative", "among", "the true set is named or an alternative, by group of cases"
    )
    false_alarms: Proportion = Field(description="cases without effects in which one was named")
    no_gap_correct: Proportion = _renamed(
        "no_gap_correct", "no_gap_on_nothing", "cases without effects with the verdict `no_gap`"
    )
    unknown_correct: Proportion = _renamed(
        "unknown_correct",
        "unknown_left_unknown",
        "cases of an unknown effect in which no library effect was named",
    )
    unknown_blamed: Proportion = Field(
        default=NOT_COUNTED,
        description="cases of an unknown effect with the verdict `explained` or a confident name",
    )
    stage_correct: Proportion = _renamed(
        "stage_correct", "stage_right", "cases of one effect, in the library or not, with the correct stage"
    )
    failures: int = Field(description="number of cases without a diagnosis; they count as not correct")
    log_score: float | None = Field(description="mean of ln(probability of the true set), each at least 0.001")
    calibration: tuple[CalibrationBin, ...] = Field(description="of the probability of the named set")
    effect_calibration: tuple[CalibrationBin, ...] = Field(description="of the probability of each named effect")
    shrinkage: ShrinkageScore
    effects: dict[str, EffectScore] = Field(description="by name")
    confusion: dict[str, dict[str, int]] = Field(description="true set -> named set -> number of cases")
    seconds_median: float | None = Field(description="[s] median duration of a diagnosis")
    seconds_max: float | None = _renamed("seconds_max", "seconds_most", "[s] longest duration of a diagnosis")


class TrialReport(FrozenModel):
    """Result of a trial."""

    schema_: Literal["mrbench.trial/1"] = Field(default="mrbench.trial/1", alias="schema")
    version: str = Field(description="version of mrbench when the truth was sealed")
    seed: int = Field(description="seed of the random draw")
    kind: TrialKind = _renamed("kind", "draw", "blind mixture, or single effects over a grid of sizes")
    sealed_sha256: str = Field(description="of the truth, published before the first recording")
    scores: Scores
    cases: tuple[CaseResult, ...]

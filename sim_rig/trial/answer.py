"""The answer of a trial, `mrbench.trial/1`: every case with its truth and its diagnosis, and the scores."""

import json
from typing import Literal

from pydantic import Field

from sim_rig.trial.folder import Draw
from sim_rig.trial.truth import CaseKind, Document, Magnitude, MethodKind


class Share(Document):
    """So many of so many."""

    count: int = Field(description="how many did")
    of: int = Field(description="of how many")
    share: float | None = Field(description="[1] the one over the other; null where there are none")
    ci95: tuple[float, float] | None = Field(description="[1] 95 % interval (Wilson); null where there are none")


class NamedSet(Document):
    """A set of effects with its odds."""

    effects: tuple[str, ...] = Field(description="names, sorted; empty for none")
    probability: float = Field(description="[1] of exactly this set")


class CaseAnswer(Document):
    """One case, unsealed."""

    id: str = Field(description="name of the case")
    kind: CaseKind = Field(description="how many effects, and whether the library is to know them")
    magnitude: Magnitude | None = Field(description="size of its effects; null for nothing")
    method: MethodKind = Field(description="rich or poor")
    damper: str = Field(description="small, middle or large")
    noise: str = Field(description="white or coloured")
    over_wires: bool = Field(description="whether it was recorded over wires")
    truth: tuple[str, ...] = Field(description="names of what was at work, sorted")
    ratios: dict[str, float] = Field(description="[1] of each: refitted law over the floor, if it were alone")
    failure: str | None = Field(description="why there is no diagnosis")
    seconds: float = Field(description="[s] that the diagnosis took")
    verdict: str | None = Field(default=None, description="of the diagnosis")
    named: NamedSet | None = Field(default=None, description="first choice")
    alternatives: tuple[NamedSet, ...] = Field(default=(), description="at most three others")
    unknown_probability: float = Field(default=0.0, description="[1] that something unknown is at work")
    odds: dict[str, float] = Field(default={}, description="[1] of each named effect, that it is at work at all")
    stage: str | None = Field(default=None, description="likeliest stage")
    before_over_floor: float | None = Field(default=None, description="[1] refitted law over floor, held out")
    after_over_floor: float | None = Field(default=None, description="[1] the same with what was named")
    claimed_shrinkage: float | None = Field(default=None, description="[1] by the diagnosis, on held-out strokes")
    claimed_ci95: tuple[float, float] | None = Field(default=None, description="[1] its interval")
    true_shrinkage: float | None = Field(
        default=None, description="[1] of the twin on a run that the diagnosis never saw"
    )
    right: bool = Field(description="the very set is named first: none for nothing, none but a gap for unknown")
    among: bool = Field(description="the very set is the first choice or an alternative")
    probability_of_truth: float = Field(description="[1] that the diagnosis gave to what is true")


class Bin(Document):
    """Claims of nearly the same probability."""

    low: float = Field(description="[1] from")
    high: float = Field(description="[1] to")
    claims: int = Field(description="how many")
    claimed: float = Field(description="[1] their mean")
    came_true: float = Field(description="[1] part that was right")


class Shrinkage(Document):
    """Claimed against true shrinkage."""

    cases: int = Field(description="that have both")
    claimed: float | None = Field(description="[1] mean of what was claimed")
    true: float | None = Field(description="[1] mean of what came true")
    median_difference: float | None = Field(description="[1] median of the absolute difference")
    inside_interval: Share = Field(description="true value within the claimed 95 % interval")


class SizeBin(Document):
    """Cases in which an effect has nearly the same size."""

    low: float = Field(description="[1] ratio from")
    high: float = Field(description="[1] ratio to")
    cases: int = Field(description="how many")
    found: int = Field(description="in how many it was named")


class EffectScore(Document):
    """How one effect fares."""

    cases: int = Field(description="in which it is at work")
    found: int = Field(description="of these, in which it was named")
    alone: Share = Field(description="of those with this effect alone: it alone was named")
    falsely: int = Field(description="cases without it in which it was named")
    detection: tuple[SizeBin, ...] = Field(description="named over size")


class Scores(Document):
    """What the trial says of the diagnosis."""

    named_first: dict[str, Share] = Field(description="the very set named first, by group of cases")
    among: dict[str, Share] = Field(description="the very set named first or among the alternatives, by group")
    false_alarms: Share = Field(description="cases without any effect in which one was named")
    no_gap_on_nothing: Share = Field(description="cases without any effect whose verdict is `no_gap`")
    unknown_left_unknown: Share = Field(description="cases of an unknown effect that were blamed on no known one")
    stage_right: Share = Field(description="cases of one effect, known or not, whose stage was held the likeliest")
    failures: int = Field(description="cases without a diagnosis; they count as not right")
    log_score: float | None = Field(description="mean of ln(probability given to the truth), floored at 0.001")
    calibration: tuple[Bin, ...] = Field(description="of the probability of the first choice")
    effect_calibration: tuple[Bin, ...] = Field(description="of the probability of each named effect")
    shrinkage: Shrinkage
    effects: dict[str, EffectScore] = Field(description="by name")
    confusion: dict[str, dict[str, int]] = Field(description="truth -> named first -> how often")
    seconds_median: float | None = Field(description="[s] a diagnosis, median")
    seconds_most: float | None = Field(description="[s] a diagnosis, longest")


class Trial(Document):
    """The answer of a trial."""

    schema_: Literal["mrbench.trial/1"] = Field(default="mrbench.trial/1", alias="schema")
    version: str = Field(description="of mrbench when the truth was sealed")
    seed: int = Field(description="of the draw")
    draw: Draw = Field(description="blind mixture, or single effects over a grid of sizes")
    sealed_sha256: str = Field(description="of the truth, published before anything was recorded")
    scores: Scores
    cases: tuple[CaseAnswer, ...]


def trial_schema() -> str:
    """The JSON Schema of the document, as committed in the reference."""
    return json.dumps(Trial.model_json_schema(by_alias=True), indent=2, ensure_ascii=False) + "\n"

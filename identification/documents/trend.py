"""Document on changes over the runs of one specimen: mrbench.trend/1."""

from typing import Annotated, Any, Literal

from pydantic import AliasChoices, BeforeValidator, Field

from identification.documents.diagnosis import Verdict
from identification.documents.document import Document
from identification.documents.fit import Provenance

TrendDirection = Literal["rising", "falling", "steady"]
_FORMER_DIRECTIONS = {"grows": "rising", "falls": "falling"}
"""Values in documents of earlier versions."""


def _replace_former_direction(value: Any) -> Any:
    return _FORMER_DIRECTIONS.get(value, value) if isinstance(value, str) else value


class TrendRun(Document):
    """One run and the result of its own diagnosis."""

    log: str = Field(description="file name of the log")
    verdict: Verdict = Field(description="verdict of the diagnosis of this run alone")
    effects: list[str] = Field(description="effects named by that diagnosis")
    before_n: float = Field(description="RMSE of the refitted law on validation strokes, in N")
    noise_floor_n: float = Field(description="noise of the recorded force, in N")


class TrendValue(Document):
    """A quantity in one run."""

    log: str = Field(description="file name of the log")
    value: float = Field(description="estimated value, in the quantity's unit")
    ci95: tuple[float, float] | None = Field(
        description="95 % interval, in the quantity's unit; null where the run does not determine it"
    )


class QuantityTrend(Document):
    """Course of one quantity over the runs."""

    quantity: str = Field(description="`effect.parameter`, or a coordinate of the law")
    unit: str = Field(description="SI unit")
    direction: Annotated[TrendDirection, BeforeValidator(_replace_former_direction)] = Field(
        validation_alias=AliasChoices("direction", "way"), description="direction of the change over the runs"
    )
    since: str | None = Field(description="first log that shows the change; null if steady")
    change_per_run: float = Field(
        validation_alias=AliasChoices("change_per_run", "per_run"),
        description="change per run from that log on, in the unit; 0 if steady",
    )
    deviations: float = Field(description="whole change over its standard deviation")
    values: list[TrendValue] = Field(
        validation_alias=AliasChoices("values", "sizes"), description="value in each run, in the order of the runs"
    )


class Trend(Document):
    """Changes over the runs of one specimen, and since when they show."""

    schema_: Literal["mrbench.trend/1"] = Field(default="mrbench.trend/1", alias="schema")
    specimen: str = Field(description="name of the specimen in the logs")
    runs: list[TrendRun] = Field(description="runs in the order of time")
    effects: list[str] = Field(
        description="effects fitted together with the law in every run: those that the diagnosis of any run names"
    )
    changes: list[QuantityTrend] = Field(description="sizes of the effects first, then the coordinates of the law")
    explanation: str = Field(description="rising and falling quantities as text for a person")
    provenance: Provenance

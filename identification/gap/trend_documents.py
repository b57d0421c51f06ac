"""What a specimen's life shows over several runs, as a document."""

from typing import Literal

from pydantic import Field

from identification.gap.documents import Verdict
from identification.results import Document, Provenance

Way = Literal["grows", "falls", "steady"]


class RunOfLife(Document):
    """One run and its own diagnosis."""

    log: str = Field(description="file name")
    verdict: Verdict = Field(description="of the diagnosis of this run alone")
    effects: list[str] = Field(description="named by it")
    before_n: float = Field(description="RMSE of the refitted law on unseen strokes, in N")
    noise_floor_n: float = Field(description="in N")


class Size(Document):
    """A quantity in one run."""

    log: str = Field(description="file name")
    value: float = Field(description="best value, in the quantity's unit")
    ci95: tuple[float, float] | None = Field(
        description="95 % interval, in the unit; null where the run is silent"
    )


class Change(Document):
    """A quantity over the runs."""

    quantity: str = Field(description="`effect.parameter`, or a coordinate of the law")
    unit: str = Field(description="SI unit")
    way: Way = Field(description="what it does over the runs")
    since: str | None = Field(description="first log that shows the change; null where it is steady")
    per_run: float = Field(description="change from run to run from there on, in the unit; 0 where it is steady")
    deviations: float = Field(description="whole change over its own standard deviation")
    sizes: list[Size] = Field(description="in the order of the runs")


class Trend(Document):
    """What changes over the runs of one specimen, and since when."""

    schema_: Literal["mrbench.trend/1"] = Field(default="mrbench.trend/1", alias="schema")
    specimen: str = Field(description="as the logs name it")
    runs: list[RunOfLife] = Field(description="in the order of time")
    effects: list[str] = Field(
        description="fitted beside the law in every run: those that any run's diagnosis names"
    )
    changes: list[Change] = Field(description="sizes of the effects first, then the law's coordinates")
    explanation: str = Field(description="for a person: what grows or falls, by how much, since when")
    provenance: Provenance

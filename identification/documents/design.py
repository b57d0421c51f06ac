"""Document on what planned strokes can identify: mrbench.foresight/1."""

from typing import Any, Literal

from pydantic import AliasChoices, Field

from identification.documents.document import Document


class ExpectedPrecision(Document):
    """Smallest standard deviation of one coordinate that the planned strokes allow."""

    value: float = Field(description="value of the assumed damper, in `unit`")
    unit: str = Field(description="SI unit")
    deviation_percent: float | None = Field(
        validation_alias=AliasChoices("deviation_percent", "percent"),
        description="smallest standard deviation, in % of the coordinate's size; null where not observable",
    )
    identifiable: bool = Field(
        validation_alias=AliasChoices("identifiable", "fixed"),
        description="whether the deviation is below half of the coordinate's size",
    )
    note: str = Field(description="precision, or the reason why the coordinate is not identifiable")


class PrecisionGain(Document):
    """Precision of one coordinate without and with the proposed stroke."""

    before_percent: float | None = Field(
        description="standard deviation without the stroke, in %; null where not observable"
    )
    after_percent: float = Field(description="standard deviation with the stroke, in %")


class StrokeProposal(Document):
    """The optional stroke that improves the poorest coordinates most."""

    segment: dict[str, Any] = Field(description="segment of a method, within the method's limits")
    gains: dict[str, PrecisionGain] = Field(description="coordinates that the stroke improves, by name")
    message: str = Field(
        validation_alias=AliasChoices("message", "words"), description="the proposal as text for a person"
    )


class DesignReport(Document):
    """Expected precision of the strokes of a method, and a proposal for one more stroke."""

    schema_: Literal["mrbench.foresight/1"] = Field(default="mrbench.foresight/1", alias="schema")
    method: str = Field(description="name of the method")
    damper: str = Field(description="assumed damper: name of a parameter set, or the model's file")
    noise_n: float = Field(description="assumed standard deviation of the force noise (white), in N")
    drive_unit: str = Field(description="V or A")
    coordinates: dict[str, ExpectedPrecision] = Field(description="regular coordinates, by name")
    proposal: StrokeProposal | None = Field(
        validation_alias=AliasChoices("proposal", "add"),
        description="null where every coordinate is precise enough, or no stroke improves one",
    )
    messages: list[str] = Field(
        validation_alias=AliasChoices("messages", "words"), description="the report as lines of text for a person"
    )

"""What planned strokes can tell, as a document."""

from typing import Any, Literal

from pydantic import Field

from identification.results import Document


class Foreseen(Document):
    """How well the planned strokes can fix one coordinate."""

    value: float = Field(description="of the damper that was assumed, in `unit`")
    unit: str = Field(description="SI unit")
    percent: float | None = Field(description="standard deviation at best, in % of its size; null where unseen")
    fixed: bool = Field(description="whether that is better than half its size")
    note: str = Field(description="what a person should know about it")


class Gain(Document):
    """What a further stroke does for one coordinate."""

    before_percent: float | None = Field(description="standard deviation without it, in %; null where unseen")
    after_percent: float = Field(description="standard deviation with it, in %")


class StrokeToAdd(Document):
    """The further stroke that helps most."""

    segment: dict[str, Any] = Field(description="a segment of a method, within the method's limits")
    gains: dict[str, Gain] = Field(description="the coordinates that it helps")
    words: str = Field(description="the same for a person")


class Foresight(Document):
    """What the strokes of a method can tell of a damper, at best."""

    schema_: Literal["mrbench.foresight/1"] = Field(default="mrbench.foresight/1", alias="schema")
    method: str = Field(description="name of the method")
    damper: str = Field(description="the damper that was assumed: a parameter set's name, or the model's file")
    noise_n: float = Field(description="white noise of the recorded force that was assumed, in N")
    drive_unit: str = Field(description="V or A")
    coordinates: dict[str, Foreseen] = Field(description="the regular coordinates")
    add: StrokeToAdd | None = Field(description="null where every coordinate is well fixed, or nothing helps")
    words: list[str] = Field(description="all of it for a person, a line each")

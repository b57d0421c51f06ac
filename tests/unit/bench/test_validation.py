"""Validation errors as messages for the author of a document."""

from typing import Annotated, Literal

import pytest
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, field_validator

from bench.validation import describe_validation_error, get_first_error


class Circle(BaseModel):
    """A shape."""

    model_config = ConfigDict(extra="forbid")

    kind: Literal["circle"]
    radius: float = Field(gt=0)

    @field_validator("radius")
    @classmethod
    def _fits(cls, radius):
        if radius > 10:
            raise ValueError(f"radius {radius:g} m does not fit into 10 m")
        return radius


class Square(BaseModel):
    """Another."""

    kind: Literal["square"]


SHAPES = TypeAdapter(Annotated[Circle | Square, Field(discriminator="kind")])


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ({"kind": "circle"}, "is missing"),
        ({"kind": "circle", "radius": 1, "raduis": 2}, "no such key; check its spelling"),
        ({"kind": "oval"}, "kind 'oval' is none of 'circle', 'square'"),
        ({"kind": "circle", "radius": 11}, "radius 11 m does not fit into 10 m"),
        ({"kind": "circle", "radius": "x", "a": 1, "b": 2}, ".* (and 2 more)"),
    ],
)
def test_a_validation_error_becomes_a_message_for_the_author(document, words):
    with pytest.raises(ValidationError) as refused:
        SHAPES.validate_python(document)
    message = get_first_error(refused.value)[1]
    assert message == words or (words.startswith(".*") and message.endswith(words.removeprefix(".*")))


def test_a_validation_error_names_its_position():
    with pytest.raises(ValidationError) as refused:
        SHAPES.validate_python({"kind": "circle", "radius": 11})
    assert describe_validation_error(refused.value) == "circle.radius: radius 11 m does not fit into 10 m"
    with pytest.raises(ValidationError) as refused:
        SHAPES.validate_python(7)
    assert describe_validation_error(refused.value, "the shape").startswith("the shape: ")

"""The method document `mrbench.method/1`: planned strokes, told apart from any specimen and any bench.

The document says what shall happen; ``compile.py`` turns it into exact samples, ``envelope.py`` tells beforehand
what they will ask of the machine. A method that ships with the product goes by its name, any other by its file.
"""

import json
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal, Self, TypeAlias

from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, ValidationError, model_validator

from bench.errors import MethodError
from bench.faults import first_fault
from bench.methods.drive import Constant, Drive
from bench.methods.frozen import Frozen
from bench.methods.motion import Motion, Sine

DriveKind: TypeAlias = Literal["driver_command_v", "coil_v", "coil_a"]


class Limits(Frozen):
    """What the method never exceeds, in any direction; it is refused where it would."""

    stroke_m: PositiveFloat = Field(description="[m] largest displacement from zero.")
    velocity_mps: PositiveFloat = Field(description="[m/s] largest velocity.")
    acceleration_mps2: PositiveFloat = Field(description="[m/s²] largest acceleration.")
    force_n: PositiveFloat = Field(
        description="[N] largest force; the dry run compares it with what a damper is expected to give."
    )
    drive: PositiveFloat = Field(description="[V or A] largest drive.")


class WarmUp(Frozen):
    """Sine strokes that are recorded but belong to no segment."""

    motion: Sine = Field(description="The strokes, about displacement zero.")
    cycles: PositiveInt = Field(description="[1] how many.")
    drive: Constant = Field(description="The drive meanwhile.")


class Stage(Frozen):
    """What happens before a segment: strokes that bring the damper into its usual state, then a rest."""

    warm_up: WarmUp | None = Field(default=None, description="Strokes first.")
    rest_s: NonNegativeFloat = Field(default=0.0, description="[s] rest after them, with the drive at zero.")


class Conditioning(Frozen):
    """What happens before the first segment, and between any two."""

    before: Stage | None = Field(default=None, description="Before the first segment.")
    between: Stage | None = Field(default=None, description="Before every later one.")


class Segment(Frozen):
    """One stretch of the method: a motion and a drive programme on one time base."""

    # Without commas and wildcards: segments are chosen by patterns, several in a row.
    name: str = Field(min_length=1, pattern=r"^[^\s,*?\[\]/]+$", description="Its name in the log, unique.")
    motion: Motion = Field(description="The motion about the centre.")
    centre_m: float = Field(default=0.0, description="[m] the centre.")
    fade_s: PositiveFloat = Field(
        default=0.5, description="[s] soft start before and soft stop after an oscillating motion, not counted."
    )
    cycles: PositiveInt | None = Field(default=None, description="[1] length in whole cycles of the motion.")
    duration_s: PositiveFloat | None = Field(default=None, description="[s] length, instead of cycles.")
    drive: Drive = Field(description="The drive programme, from the segment's start to its end.")
    checkpoint: bool = Field(
        default=False, description="Whether an interrupted run may be taken up after this segment."
    )

    @model_validator(mode="after")
    def _either_cycles_or_duration(self) -> Self:
        if (self.cycles is None) == (self.duration_s is None):
            raise ValueError("a segment needs either cycles or duration_s")
        return self


class Method(Frozen):
    """The planned strokes of a test."""

    schema_name: Literal["mrbench.method/1"] = Field(alias="schema", description="Name of this form.")
    name: str = Field(pattern=r"^[A-Za-z0-9_-]+$", description="Short name: letters, digits, - and _.")
    title: str = Field(min_length=1, description="One line for a person.")
    description: str = Field(description="What it is for, whatever the specimen.")
    rate_hz: PositiveFloat = Field(le=1e5, description="[Hz] samples a second of commands and log.")
    drive_kind: DriveKind = Field(description="What commands the damper: volt or ampere at the coil.")
    limits: Limits = Field(description="What it never exceeds.")
    conditioning: Conditioning = Field(default=Conditioning(), description="Warm-up and rests.")
    segments: tuple[Segment, ...] = Field(min_length=1, description="The stretches, in their order.")

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [segment.name for segment in self.segments]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise ValueError(f"segment name {twice[0]} is used twice; every segment needs its own")
        return self

    @property
    def drive_unit(self) -> str:
        """``V`` or ``A``."""
        return "A" if self.drive_kind == "coil_a" else "V"

    def to_json(self) -> str:
        """The document as indented JSON, without what is left at its default."""
        return self.model_dump_json(by_alias=True, indent=2, exclude_defaults=True) + "\n"


def shipped_methods() -> list[str]:
    """Names of the methods that ship with the product, sorted."""
    library = files("bench.methods") / "library"
    return sorted(entry.name.removesuffix(".json") for entry in library.iterdir() if entry.name.endswith(".json"))


def method_of(content: Any, origin: str) -> Method:
    """The method that a parsed document describes; ``origin`` names it in messages.

    Raises:
        MethodError: it is not of the form; the message names the place.
    """
    try:
        return Method.model_validate(content)
    except ValidationError as error:
        raise MethodError(f"{origin} is no method: {_first_fault(error, content)}") from None


def load_method(name_or_path: str | Path) -> Method:
    """A shipped method by its name, or any other from its file.

    Raises:
        MethodError: there is no such method, or the document is not of the form; the message names the place.
    """
    text = _text(name_or_path)
    try:
        content = json.loads(text)
    except ValueError as error:
        raise MethodError(f"{name_or_path} is no method: not JSON, {error}") from None
    return method_of(content, str(name_or_path))


def _text(name_or_path: str | Path) -> str:
    if str(name_or_path) in shipped_methods():
        return (files("bench.methods") / "library" / f"{name_or_path}.json").read_text("utf-8")
    try:
        return Path(name_or_path).read_text("utf-8")
    except FileNotFoundError:
        raise MethodError(
            f"no method {name_or_path}: neither a file nor one of {', '.join(shipped_methods())}"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise MethodError(f"method {name_or_path} cannot be read: {error}") from None


def _first_fault(error: ValidationError, content: Any) -> str:
    """The first fault with its place in the document, and how many more there are."""
    first, words = first_fault(error)
    place = ".".join(str(step) for step in first["loc"]) or "the document"
    named = _segment_name(first["loc"], content)
    return f"{place}{named}: {words}"


def _segment_name(place: tuple[int | str, ...], content: Any) -> str:
    if len(place) < 2 or place[0] != "segments" or not isinstance(place[1], int):
        return ""
    segment = content["segments"][place[1]]
    return f" ({segment['name']})" if isinstance(segment, dict) and "name" in segment else ""

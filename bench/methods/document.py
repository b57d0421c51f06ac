"""Method document `mrbench.method/1`: planned strokes, independent of specimen and bench.

``compile.py`` converts it to exact samples, and ``envelope.py`` computes their peaks before a run. A shipped
method is loaded by its name, any other by its file.
"""

import hashlib
import json
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal, Self, TypeAlias

from pydantic import Field, NonNegativeFloat, PositiveFloat, PositiveInt, ValidationError, model_validator

from bench.errors import MethodError
from bench.methods.drive import Constant, Drive
from bench.methods.motion import Motion, Sine
from bench.validation import FrozenModel, format_position, get_first_error

DriveKind: TypeAlias = Literal["driver_command_v", "coil_v", "coil_a"]


class MethodLimits(FrozenModel):
    """Limits on the magnitudes of the method; a method that exceeds them is refused."""

    stroke_m: PositiveFloat = Field(description="[m] largest displacement from zero.")
    velocity_mps: PositiveFloat = Field(description="[m/s] largest velocity.")
    acceleration_mps2: PositiveFloat = Field(description="[m/s²] largest acceleration.")
    force_n: PositiveFloat = Field(
        description="[N] largest force; the dry run compares it with the force expected of a damper."
    )
    drive: PositiveFloat = Field(description="[V or A] largest drive.")


class WarmUp(FrozenModel):
    """Sine strokes that are recorded but belong to no segment."""

    motion: Sine = Field(description="Motion about displacement zero.")
    cycles: PositiveInt = Field(description="[1] number of cycles.")
    drive: Constant = Field(description="Constant drive.")


class ConditioningStage(FrozenModel):
    """Conditioning before a segment: strokes that bring the damper into its usual state, then a rest."""

    warm_up: WarmUp | None = Field(default=None, description="Warm-up strokes.")
    rest_s: NonNegativeFloat = Field(default=0.0, description="[s] rest after the warm-up, with zero drive.")


class Conditioning(FrozenModel):
    """Conditioning before the first segment and between segments."""

    before: ConditioningStage | None = Field(default=None, description="Before the first segment.")
    between: ConditioningStage | None = Field(default=None, description="Before every later segment.")


class MethodSegment(FrozenModel):
    """Part of a method: a motion and a drive programme on one time base."""

    # Without commas and wildcards, because segments are selected by lists of patterns.
    name: str = Field(min_length=1, pattern=r"^[^\s,*?\[\]/]+$", description="Unique name in the log.")
    motion: Motion = Field(description="Motion about the centre.")
    centre_m: float = Field(default=0.0, description="[m] centre of the motion.")
    fade_s: PositiveFloat = Field(
        default=0.5,
        description="[s] soft start before and soft stop after an oscillating motion, not part of its duration.",
    )
    cycles: PositiveInt | None = Field(default=None, description="[1] duration in whole cycles of the motion.")
    duration_s: PositiveFloat | None = Field(default=None, description="[s] duration, instead of cycles.")
    drive: Drive = Field(description="Drive programme from the start to the end of the segment.")
    checkpoint: bool = Field(
        default=False, description="Whether an interrupted run can be resumed after this segment."
    )
    shunt: bool = Field(
        default=False,
        description="Whether the shunt of the load cell is on; only at rest: motion hold, constant drive 0.",
    )

    @model_validator(mode="after")
    def _check_length(self) -> Self:
        if (self.cycles is None) == (self.duration_s is None):
            raise ValueError("a segment needs either cycles or duration_s")
        return self


class Method(FrozenModel):
    """Planned strokes of a test."""

    schema_name: Literal["mrbench.method/1"] = Field(
        alias="schema", description="Name and version of this document type."
    )
    name: str = Field(pattern=r"^[A-Za-z0-9_-]+$", description="Short name: letters, digits, - and _.")
    title: str = Field(min_length=1, description="One line for a person.")
    description: str = Field(description="Purpose of the method, independent of the specimen.")
    rate_hz: PositiveFloat = Field(le=1e5, description="[Hz] sampling rate of commands and log.")
    drive_kind: DriveKind = Field(description="Quantity that commands the damper, in volts or amperes.")
    limits: MethodLimits = Field(description="Limits of the method.")
    conditioning: Conditioning = Field(default=Conditioning(), description="Warm-up and rests.")
    segments: tuple[MethodSegment, ...] = Field(min_length=1, description="Segments in order.")

    @model_validator(mode="after")
    def _check_unique_names(self) -> Self:
        names = [segment.name for segment in self.segments]
        repeated = sorted({name for name in names if names.count(name) > 1})
        if repeated:
            raise ValueError(f"segment name {repeated[0]} is used twice; give every segment a unique name")
        return self

    @property
    def drive_unit(self) -> str:
        """Unit of the drive, ``V`` or ``A``."""
        return "A" if self.drive_kind == "coil_a" else "V"

    def compute_sha256(self) -> str:
        """Compute the hash of the content; the form of the document and default values do not count."""
        content = self.model_dump(mode="json", by_alias=True, exclude_defaults=True)
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    def to_json(self) -> str:
        """Return the document as indented JSON, without default values."""
        return self.model_dump_json(by_alias=True, indent=2, exclude_defaults=True) + "\n"


def list_shipped_methods() -> list[str]:
    """Return the names of the shipped methods, sorted."""
    library = files("bench.methods") / "library"
    return sorted(entry.name.removesuffix(".json") for entry in library.iterdir() if entry.name.endswith(".json"))


def parse_method(content: Any, origin: str) -> Method:
    """Return the method of a parsed document; ``origin`` names the document in messages.

    Raises:
        MethodError: the document is invalid; the message names the position.
    """
    try:
        return Method.model_validate(content)
    except ValidationError as error:
        raise MethodError(f"{origin} is not a method: {_describe_error(error, content)}") from None


def load_method(name_or_path: str | Path) -> Method:
    """Load a shipped method by its name, or any other method from its file.

    Raises:
        MethodError: there is no such method, or the document is invalid; the message names the position.
    """
    text = _read_text(name_or_path)
    try:
        content = json.loads(text)
    except ValueError as error:
        raise MethodError(f"{name_or_path} is not a method: not JSON, {error}") from None
    return parse_method(content, str(name_or_path))


def _read_text(name_or_path: str | Path) -> str:
    if str(name_or_path) in list_shipped_methods():
        return (files("bench.methods") / "library" / f"{name_or_path}.json").read_text("utf-8")
    try:
        return Path(name_or_path).read_text("utf-8")
    except FileNotFoundError:
        raise MethodError(
            f"no method {name_or_path}: neither a file nor one of {', '.join(list_shipped_methods())}"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise MethodError(f"method {name_or_path} cannot be read: {error}") from None


def _describe_error(error: ValidationError, content: Any) -> str:
    """Describe the first fault with its position, and the name of its segment."""
    first, message = get_first_error(error)
    return f"{format_position(first['loc'])}{_format_segment_name(first['loc'], content)}: {message}"


def _format_segment_name(position: tuple[int | str, ...], content: Any) -> str:
    if len(position) < 2 or position[0] != "segments" or not isinstance(position[1], int):
        return ""
    segment = content["segments"][position[1]]
    return f" ({segment['name']})" if isinstance(segment, dict) and "name" in segment else ""

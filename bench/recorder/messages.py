"""What stands in a log: the messages of its topics, and what its metadata records say.

Every message is one JSON object that carries its own time. The JSON Schema in the log says each field's unit.
Viewers know only plain types there: no references, no unions. So the time is written out in place, an optional
field is left out of the message, and the few fields that may be null are declared as pattern properties, which
viewers pass over and validators hold to.
"""

from typing import Any, Literal, TypeAlias, get_args

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

PROFILE = "mrbench"
SAMPLE, SEGMENT, EVENT = "/bench/sample", "/bench/segment", "/bench/event"

Outcome: TypeAlias = Literal["clean", "lossy", "truncated", "incomplete"]
"""How a log ended: whole; samples lost on the way; cut off and mended; stopped before the end."""

Phase: TypeAlias = Literal["start", "end"]
"""Which end of a segment."""

JsonSchema: TypeAlias = dict[str, Any]

_FROZEN = ConfigDict(frozen=True, extra="forbid")


def _quantity(text: str, unit: str, **more: Any) -> Any:
    return Field(description=f"[{unit}] {text}", json_schema_extra={"unit": unit}, **more)


class Timestamp(BaseModel):
    """Bench clock, in the shape that viewers take for a time."""

    model_config = _FROZEN

    sec: int = _quantity("whole seconds of the bench clock", "s", ge=0)
    nsec: int = _quantity("nanoseconds beyond the whole second", "ns", ge=0, lt=1_000_000_000)


class Sample(BaseModel):
    """One bench sample: every channel at one instant, so that any two can be plotted over each other."""

    model_config = _FROZEN

    timestamp: Timestamp = Field(description="[s] bench clock; equal to the message's log and publish time")
    displacement: float = _quantity("displacement at the actuator, positive where the damper extends", "m")
    velocity: float = _quantity("rate of displacement; metadata `units` says how it was made", "m/s")
    force: float = _quantity("axial force, tension positive", "N")
    coil_drive: float = _quantity("measured drive; metadata `run` says which kind, in V or A", "V or A")
    displacement_command: float | None = _quantity("commanded displacement", "m", default=None)
    coil_drive_command: float | None = _quantity("commanded drive", "V or A", default=None)
    actuator_position: float | None = _quantity("position reported by the drive's encoder", "m", default=None)
    coil_current: float | None = _quantity("current through the coil", "A", default=None)
    coil_voltage: float | None = _quantity("voltage across the coil", "V", default=None)
    temperature: float | None = _quantity("temperature of the specimen", "degC", default=None)
    force_raw: float | None = _quantity("axial force without the tare of its instrument", "N", default=None)
    segment: int | None = _quantity("index of the segment; left out between segments", "1", default=None, ge=0)


class Segment(BaseModel):
    """The start or the end of one segment."""

    model_config = _FROZEN

    timestamp: Timestamp = Field(description="[s] bench clock of the segment's first or last sample")
    phase: Phase = Field(description="which end of the segment this message marks")
    index: int = _quantity("place of the segment in the log, from 0", "1", ge=0)
    name: str = Field(description="name of the segment, unique in the log's stretch")
    stretch: str = Field(description="name of the continuous recording that the segment stands in")
    motion: str = Field(description="kind of motion: sine, hold, random, ...")
    amplitude: float | None = _quantity("amplitude of the motion; null where it has none", "m")
    frequency: float | None = _quantity("frequency of the motion; null where it has none", "Hz")
    drive: str = Field(description="kind of drive programme: constant, staircase, steps, ...")
    drive_value: float | None = _quantity("drive where it is constant; null where it varies", "V or A")


class Event(BaseModel):
    """Something that happened: a change of state, a command, an alarm. Further fields say more."""

    model_config = ConfigDict(frozen=True, extra="allow")

    timestamp: Timestamp = Field(description="[s] bench clock")
    kind: str = Field(description="what sort of event: state, command, alarm, trip, late, checkpoint, ...")
    text: str = Field(description="what happened, in words")
    quantity: str | None = Field(default=None, description="what was judged, of an alarm or a trip: force, ...")
    value: float | None = _quantity("value that it had, in the quantity's own unit", "SI", default=None)
    limit: float | None = _quantity("limit that it exceeded, in the same unit", "SI", default=None)


def _list_of(text: str, unit: str) -> Any:
    return Field(description=f"[{unit}] {text}, one a sample", json_schema_extra={"unit": unit})


class Readings(BaseModel):
    """Samples of one channel as its instrument gave them: consecutive, of one quality."""

    model_config = _FROZEN

    timestamp: Timestamp = Field(description="[s] bench clock of the first sample, as mapped")
    channel: str = Field(description="name of the channel")
    first: int = _quantity("running number of the first sample; a gap to the message before is a loss", "1")
    quality: Literal["good", "uncertain", "bad"] = Field(
        description="good: checked and in range; uncertain: no checksum or clock vouches for it; bad: not used"
    )
    received: list[int] = _list_of("bench clock when the sample had come, after the timestamp", "ns")
    bench: list[int] = _list_of("bench clock of the conversion as mapped, after the timestamp", "ns")
    device: list[int] = _list_of("the instrument's own clock at the conversion; empty where it has none", "ns")
    raw: list[float] = _list_of("what stood on the wire, in the wire's own unit", "1")
    values: list[float] = _list_of("in the channel's unit, see attachment `instruments.json`", "SI")
    missing: list[int] = Field(description="[1] places among the values that are no numbers; zero stands there")


class Frames(BaseModel):
    """What passed on one wire, as it was received and sent."""

    model_config = _FROZEN

    timestamp: Timestamp = Field(description="[s] bench clock of the first frame")
    at: list[int] = Field(description="[ns] bench clock of each frame, after the timestamp")
    sent: list[bool] = Field(description="[1] whether each frame was sent by the bench; else it was received")
    data: list[str] = Field(description="[1] the bytes of each frame, base64")


INSTRUMENT, WIRE = "/instrument/", "/wire/"
"""Beginnings of the topics that there is one of for each instrument."""

MESSAGES: dict[str, type[BaseModel]] = {SAMPLE: Sample, SEGMENT: Segment, EVENT: Event}
"""Message type by topic; these stand in every log."""
FAMILIES: dict[str, type[BaseModel]] = {INSTRUMENT: Readings, WIRE: Frames}
"""Message type by the beginning of a topic, for topics that end with the name of an instrument."""

SAMPLE_FIELDS: tuple[str, ...] = tuple(name for name in Sample.model_fields if name != "timestamp")
REQUIRED_FIELDS: tuple[str, ...] = tuple(name for name in SAMPLE_FIELDS if Sample.model_fields[name].is_required())


def model_of(topic: str) -> type[BaseModel]:
    """Message type of a topic, or of the beginning of one."""
    return next((model for begin, model in FAMILIES.items() if topic.startswith(begin)), None) or MESSAGES[topic]


def _accepts_none(field: FieldInfo) -> bool:
    return type(None) in get_args(field.annotation)


def _plain(schema: JsonSchema) -> JsonSchema:
    """The schema of one field without the union that stands for `or null`, and without a default."""
    kinds: list[JsonSchema] = schema.pop("anyOf", [])
    first = next((kind for kind in kinds if kind.get("type") != "null"), {})
    return {**first, **{key: value for key, value in schema.items() if key not in ("default", "title")}}


def message_schema(topic: str) -> JsonSchema:
    """JSON Schema of a topic's message, the unit in every field's description.

    Args:
        topic: one of `MESSAGES`, or one that begins like one of `FAMILIES`.
    """
    model = model_of(topic)
    schema = model.model_json_schema()
    clock = schema.pop("$defs")["Timestamp"]
    inside = {name: _plain(field) for name, field in clock["properties"].items()}
    fields: JsonSchema = {}
    nullable: JsonSchema = {}
    for name, field in schema.pop("properties").items():
        declared = model.model_fields[name]
        if name == "timestamp":
            fields[name] = {
                **clock,
                "title": "time",
                "properties": inside,
                "description": declared.description,
            }
        elif declared.is_required() and _accepts_none(declared):
            plain = _plain(field)
            nullable[f"^{name}$"] = {**plain, "type": [plain["type"], "null"]}
        else:
            fields[name] = _plain(field)
    if nullable:
        schema["patternProperties"] = nullable
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "properties": fields}


def schema_name(topic: str) -> str:
    """Name under which a topic's schema stands in the log: ``mrbench.Sample`` and so on."""
    return f"{PROFILE}.{model_of(topic).__name__}"


def sample_units(drive_unit: str) -> dict[str, str]:
    """Unit of every field of a sample.

    Args:
        drive_unit: V or A; it stands for the drive and its command.
    """
    units = {}
    for name in SAMPLE_FIELDS:
        extra = Sample.model_fields[name].json_schema_extra
        unit = str(extra["unit"]) if isinstance(extra, dict) else "1"
        units[name] = drive_unit if unit == "V or A" else unit
    return units

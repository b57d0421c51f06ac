"""Messages of a log by topic, and their JSON Schemas.

Every message is one JSON object with its own time. The JSON Schema in the log contains the unit of each field.
Viewers support only plain types in a schema, without references and unions. The time is therefore defined in
place, and an optional field is omitted from the message. The few nullable fields are declared as pattern
properties, which viewers ignore and validators check.
"""

from typing import Any, Literal, TypeAlias, get_args

from pydantic import BaseModel, ConfigDict, Field
from pydantic.fields import FieldInfo

PROFILE = "mrbench"
NS_PER_SECOND = 1_000_000_000
SAMPLE, SEGMENT, EVENT = "/bench/sample", "/bench/segment", "/bench/event"

Outcome: TypeAlias = Literal["clean", "lossy", "truncated", "incomplete"]
"""End of a log: complete; with lost samples; truncated and repaired; stopped before the end of the method."""

Phase: TypeAlias = Literal["start", "end"]
"""Boundary of a segment."""

JsonSchema: TypeAlias = dict[str, Any]

_FROZEN = ConfigDict(frozen=True, extra="forbid")


def _make_quantity_field(text: str, unit: str, **more: Any) -> Any:
    return Field(description=f"[{unit}] {text}", json_schema_extra={"unit": unit}, **more)


class Timestamp(BaseModel):
    """Bench clock, in the form that viewers recognise as a time."""

    model_config = _FROZEN

    sec: int = _make_quantity_field("whole seconds of the bench clock", "s", ge=0)
    nsec: int = _make_quantity_field("nanoseconds beyond the whole second", "ns", ge=0, lt=1_000_000_000)


class Sample(BaseModel):
    """One bench sample: all channels at one instant, so that any two can be plotted against each other."""

    model_config = _FROZEN

    timestamp: Timestamp = Field(description="[s] bench clock; equal to the message's log and publish time")
    displacement: float = _make_quantity_field("displacement at the actuator, positive in extension", "m")
    velocity: float = _make_quantity_field("rate of displacement; its origin is in metadata `units`", "m/s")
    force: float = _make_quantity_field("axial force, positive in tension", "N")
    coil_drive: float = _make_quantity_field("measured drive; its kind is in metadata `run`", "V or A")
    displacement_command: float | None = _make_quantity_field("commanded displacement", "m", default=None)
    coil_drive_command: float | None = _make_quantity_field("commanded drive", "V or A", default=None)
    actuator_position: float | None = _make_quantity_field(
        "position reported by the drive's encoder", "m", default=None
    )
    coil_current: float | None = _make_quantity_field("current through the coil", "A", default=None)
    coil_voltage: float | None = _make_quantity_field("voltage across the coil", "V", default=None)
    temperature: float | None = _make_quantity_field("temperature of the specimen", "degC", default=None)
    force_raw: float | None = _make_quantity_field(
        "axial force without the tare of its instrument", "N", default=None
    )
    segment: int | None = _make_quantity_field(
        "index of the segment; omitted between segments", "1", default=None, ge=0
    )


class Segment(BaseModel):
    """Segment mark: the first or the last sample of one segment."""

    model_config = _FROZEN

    timestamp: Timestamp = Field(description="[s] bench clock of the segment's first or last sample")
    phase: Phase = Field(description="whether the message marks the start or the end")
    index: int = _make_quantity_field("index of the segment in the log, from 0", "1", ge=0)
    name: str = Field(description="name of the segment, unique in its stretch")
    stretch: str = Field(description="name of the stretch (continuous recording) that contains the segment")
    motion: str = Field(description="kind of motion: sine, hold, random, ...")
    amplitude: float | None = _make_quantity_field("amplitude of the motion; null if it has none", "m")
    frequency: float | None = _make_quantity_field("frequency of the motion; null if it has none", "Hz")
    drive: str = Field(description="kind of drive programme: constant, staircase, steps, ...")
    drive_value: float | None = _make_quantity_field("constant drive; null if the drive varies", "V or A")
    shunt: bool = Field(
        default=False, description="whether the shunt of the load cell adds to the force; omitted if it does not"
    )


class Event(BaseModel):
    """Event: a change of state, a command, an alarm. Additional fields contain details."""

    model_config = ConfigDict(frozen=True, extra="allow")

    timestamp: Timestamp = Field(description="[s] bench clock")
    kind: str = Field(description="kind of event: state, command, alarm, trip, late, checkpoint, ...")
    text: str = Field(description="description of the event for a person")
    quantity: str | None = Field(default=None, description="monitored quantity of an alarm or a trip: force, ...")
    value: float | None = _make_quantity_field("value of the quantity, in its own unit", "SI", default=None)
    limit: float | None = _make_quantity_field("exceeded limit, in the same unit", "SI", default=None)


def _make_list_field(text: str, unit: str) -> Any:
    return Field(description=f"[{unit}] {text}, one per sample", json_schema_extra={"unit": unit})


class Readings(BaseModel):
    """Consecutive samples of one channel and quality, as received from the instrument."""

    model_config = _FROZEN

    timestamp: Timestamp = Field(description="[s] bench clock of the first sample, from the clock map")
    channel: str = Field(description="name of the channel")
    first: int = _make_quantity_field(
        "running number of the first sample; a gap after the previous message means lost samples", "1"
    )
    quality: Literal["good", "uncertain", "bad"] = Field(
        description="good: checked and in range; uncertain: without checksum or device clock, or shifted by a "
        "shunt; bad: not used"
    )
    received: list[int] = _make_list_field("bench clock of the receipt, after the timestamp", "ns")
    bench: list[int] = _make_list_field(
        "bench clock of the conversion from the clock map, after the timestamp", "ns"
    )
    device: list[int] = _make_list_field("device clock at the conversion; empty if there is none", "ns")
    raw: list[float] = _make_list_field("value on the wire, in the unit of the wire", "1")
    values: list[float] = _make_list_field("in the channel's unit, see attachment `instruments.json`", "SI")
    missing: list[int] = Field(description="[1] indices of values that are NaN, for which `values` contains zero")


class Frames(BaseModel):
    """Frames received from and sent to one wire."""

    model_config = _FROZEN

    timestamp: Timestamp = Field(description="[s] bench clock of the first frame")
    at: list[int] = Field(description="[ns] bench clock of each frame, after the timestamp")
    sent: list[bool] = Field(description="[1] whether each frame was sent by the bench or received")
    data: list[str] = Field(description="[1] bytes of each frame, base64")


INSTRUMENT, WIRE = "/instrument/", "/wire/"
"""Prefixes of the topics that exist once for each instrument."""

MESSAGES: dict[str, type[BaseModel]] = {SAMPLE: Sample, SEGMENT: Segment, EVENT: Event}
"""Message type by topic, for the topics of every log."""
TOPIC_FAMILIES: dict[str, type[BaseModel]] = {INSTRUMENT: Readings, WIRE: Frames}
"""Message type by prefix, for topics that end with the name of an instrument."""

SAMPLE_FIELDS: tuple[str, ...] = tuple(name for name in Sample.model_fields if name != "timestamp")
REQUIRED_FIELDS: tuple[str, ...] = tuple(name for name in SAMPLE_FIELDS if Sample.model_fields[name].is_required())


def make_timestamp(time_ns: int) -> dict[str, int]:
    """Return an instant of the bench clock [ns] as a `Timestamp` in JSON."""
    seconds, nanoseconds = divmod(time_ns, NS_PER_SECOND)
    return {"sec": seconds, "nsec": nanoseconds}


def parse_timestamp(message: dict[str, Any]) -> int:
    """Return the bench clock [ns] of a message."""
    return int(message["timestamp"]["sec"] * NS_PER_SECOND + message["timestamp"]["nsec"])


def find_message_model(topic: str) -> type[BaseModel]:
    """Return the message type of a topic, or of the prefix of one."""
    return (
        next((model for begin, model in TOPIC_FAMILIES.items() if topic.startswith(begin)), None)
        or MESSAGES[topic]
    )


def _is_nullable(field: FieldInfo) -> bool:
    return type(None) in get_args(field.annotation)


def _simplify_schema(schema: JsonSchema) -> JsonSchema:
    """Return the schema of one field without default, and without the union that expresses `or null`."""
    kinds: list[JsonSchema] = schema.pop("anyOf", [])
    first = next((kind for kind in kinds if kind.get("type") != "null"), {})
    return {**first, **{key: value for key, value in schema.items() if key not in ("default", "title")}}


def make_message_schema(topic: str) -> JsonSchema:
    """Return the JSON Schema of a topic's message, with the unit in every field's description.

    Args:
        topic: one of `MESSAGES`, or with a prefix in `TOPIC_FAMILIES`.
    """
    model = find_message_model(topic)
    schema = model.model_json_schema()
    clock = schema.pop("$defs")["Timestamp"]
    inside = {name: _simplify_schema(field) for name, field in clock["properties"].items()}
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
        elif declared.is_required() and _is_nullable(declared):
            plain = _simplify_schema(field)
            nullable[f"^{name}$"] = {**plain, "type": [plain["type"], "null"]}
        else:
            fields[name] = _simplify_schema(field)
    if nullable:
        schema["patternProperties"] = nullable
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "properties": fields}


def make_schema_name(topic: str) -> str:
    """Return the name of a topic's schema in the log, such as ``mrbench.Sample``."""
    return f"{PROFILE}.{find_message_model(topic).__name__}"


def list_sample_units(drive_unit: str) -> dict[str, str]:
    """Return the unit of every field of a sample.

    Args:
        drive_unit: unit of the drive and its command, V or A.
    """
    units = {}
    for name in SAMPLE_FIELDS:
        extra = Sample.model_fields[name].json_schema_extra
        unit = str(extra["unit"]) if isinstance(extra, dict) else "1"
        units[name] = drive_unit if unit == "V or A" else unit
    return units

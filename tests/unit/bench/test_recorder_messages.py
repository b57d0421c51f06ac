import json

import jsonschema
import pytest
from mcap.reader import make_reader
from recorder_examples import write_log

from bench.recorder.messages import MESSAGES, SAMPLE, SEGMENT, message_schema, sample_units, schema_name
from bench.recorder.schemas import FOLDER, schema_texts, write_schemas

PLAIN = {"object", "string", "number", "integer", "boolean"}


@pytest.mark.parametrize("name", schema_texts())
def test_schemas_in_the_documentation_are_those_of_the_types(name):
    assert (FOLDER / name).read_text(encoding="utf-8") == schema_texts()[name]


def test_schemas_can_be_written_to_a_folder(tmp_path):
    write_schemas(tmp_path / "schemas")

    assert sorted(path.name for path in (tmp_path / "schemas").iterdir()) == sorted(schema_texts())


@pytest.mark.parametrize("topic", MESSAGES)
def test_schema_has_only_what_viewers_can_read(topic):
    schema = message_schema(topic)

    assert schema["type"] == "object"
    assert "$ref" not in json.dumps(schema)
    assert {field["type"] for field in schema["properties"].values()} <= PLAIN


@pytest.mark.parametrize("topic", MESSAGES)
def test_timestamp_is_of_the_shape_that_viewers_take_for_a_time(topic):
    clock = message_schema(topic)["properties"]["timestamp"]

    assert clock["title"] == "time"
    assert list(clock["properties"]) == ["sec", "nsec"]


def test_every_quantity_of_a_sample_says_its_unit_first():
    fields = message_schema(SAMPLE)["properties"]

    assert fields["force"]["description"].startswith("[N]")
    assert all(field["description"].startswith("[") for field in fields.values())


def test_fields_of_a_segment_that_may_be_null_say_their_unit():
    nullable = message_schema(SEGMENT)["patternProperties"]

    assert nullable["^amplitude$"]["type"] == ["number", "null"]
    assert nullable["^amplitude$"]["description"].startswith("[m]")


def test_unit_of_the_drive_is_that_of_the_run():
    assert sample_units("A")["coil_drive"] == "A"
    assert sample_units("A")["coil_voltage"] == "V"


def test_every_message_in_a_log_keeps_to_its_schema(tmp_path):
    write_log(tmp_path / "run.mcap")
    validators = {schema_name(topic): jsonschema.Draft202012Validator(message_schema(topic)) for topic in MESSAGES}

    with (tmp_path / "run.mcap").open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            assert schema.name == schema_name(channel.topic)
            assert json.loads(schema.data) == validators[schema.name].schema
            validators[schema.name].validate(json.loads(message.data))

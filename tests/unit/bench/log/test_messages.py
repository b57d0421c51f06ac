import json

import jsonschema
import pytest
from mcap.reader import make_reader

from bench.log.messages import MESSAGES, SAMPLE, SEGMENT, list_sample_units, make_message_schema, make_schema_name
from tests.support.logs import write_log

PLAIN = {"object", "string", "number", "integer", "boolean"}


@pytest.mark.parametrize("topic", MESSAGES)
def test_schema_has_only_types_that_viewers_support(topic):
    schema = make_message_schema(topic)

    assert schema["type"] == "object"
    assert "$ref" not in json.dumps(schema)
    assert {field["type"] for field in schema["properties"].values()} <= PLAIN


@pytest.mark.parametrize("topic", MESSAGES)
def test_timestamp_has_the_form_of_a_time_in_viewers(topic):
    clock = make_message_schema(topic)["properties"]["timestamp"]

    assert clock["title"] == "time"
    assert list(clock["properties"]) == ["sec", "nsec"]


def test_description_of_a_field_begins_with_its_unit():
    fields = make_message_schema(SAMPLE)["properties"]

    assert fields["force"]["description"].startswith("[N]")
    assert all(field["description"].startswith("[") for field in fields.values())


def test_nullable_fields_of_a_segment_have_a_unit():
    nullable = make_message_schema(SEGMENT)["patternProperties"]

    assert nullable["^amplitude$"]["type"] == ["number", "null"]
    assert nullable["^amplitude$"]["description"].startswith("[m]")


def test_unit_of_the_drive_is_that_of_the_run():
    assert list_sample_units("A")["coil_drive"] == "A"
    assert list_sample_units("A")["coil_voltage"] == "V"


def test_every_message_in_a_log_is_valid_by_its_schema(tmp_path):
    write_log(tmp_path / "run.mcap")
    validators = {
        make_schema_name(topic): jsonschema.Draft202012Validator(make_message_schema(topic)) for topic in MESSAGES
    }

    with (tmp_path / "run.mcap").open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            assert schema.name == make_schema_name(channel.topic)
            assert json.loads(schema.data) == validators[schema.name].schema
            validators[schema.name].validate(json.loads(message.data))

"""The committed schemas of fit and prediction are those of the types."""

import json

import jsonschema
import pytest

from identification import schemas


@pytest.mark.parametrize("name", schemas.DOCUMENTS)
def test_the_kept_schema_is_that_of_the_type(name):
    kept = (schemas.FOLDER / f"{name}.json").read_text(encoding="utf-8")
    assert kept == schemas.schema_text(name), "run: python -m identification.schemas"


@pytest.mark.parametrize("name", schemas.DOCUMENTS)
def test_the_kept_schema_is_a_schema_and_names_its_version(name):
    schema = json.loads((schemas.FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["properties"]["schema"]["const"] == f"mrbench.{name}/1"


def test_schemas_can_be_written_to_a_folder(tmp_path):
    schemas.write_schemas(tmp_path / "new")
    assert sorted(path.stem for path in (tmp_path / "new").iterdir()) == sorted(schemas.DOCUMENTS)

"""Committed schemas and OpenAPI description, compared with those generated from the code."""

import json

import jsonschema
import pytest

from tests.support.reference import generator

SCHEMAS = sorted((*generator.DOCUMENTS, *generator.LOG_MESSAGES))
UNVERSIONED = {"bench", "oidc"}
"""Documents without the key `schema`: they are written by hand."""


@pytest.fixture(scope="module")
def files():
    return {path.relative_to(generator.FOLDER).as_posix(): text for path, text in generator.make_files().items()}


def read(name):
    return (generator.FOLDER / name).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["openapi.json", *(f"schemas/{name}.json" for name in SCHEMAS)])
def test_the_committed_file_equals_the_generated_one(name, files):
    assert read(name) == files[name], "run: python docs/generate_reference.py"


def test_every_committed_schema_is_generated():
    committed = {path.stem for path in (generator.FOLDER / "schemas").glob("*.json")}
    assert committed == set(SCHEMAS)


@pytest.mark.parametrize("name", SCHEMAS)
def test_a_schema_is_valid(name):
    jsonschema.Draft202012Validator.check_schema(json.loads(generator.make_schema(name)))


@pytest.mark.parametrize("name", sorted(generator.DOCUMENTS.keys() - UNVERSIONED))
def test_the_schema_of_a_document_contains_its_version(name):
    schema = json.loads(generator.make_schema(name))
    assert schema["properties"]["schema"]["const"] == f"mrbench.{name}/1"

"""The report's own types name only keys that the identification's documents have."""

import typing

import pytest
from pydantic import BaseModel

from bench.report import diagnosis, documents
from identification.documents import diagnosis as gap_documents
from identification.documents import fit


def part_of(annotation):
    """The document type inside an annotation, if there is one."""
    inside = (annotation, *typing.get_args(annotation))
    return next((kind for kind in inside if isinstance(kind, type) and issubclass(kind, BaseModel)), None)


def assert_within(read, written):
    assert set(read.model_fields) <= set(written.model_fields)
    for name, field in read.model_fields.items():
        if (inner := part_of(field.annotation)) is not None:
            assert_within(inner, part_of(written.model_fields[name].annotation))


@pytest.mark.parametrize("name", ["Fit", "Prediction"])
def test_every_key_that_a_report_reads_is_one_that_is_written(name):
    assert_within(getattr(documents, name), getattr(fit, name))


def test_every_key_of_a_diagnosis_that_a_report_reads_is_one_that_is_written():
    assert_within(diagnosis.Diagnosis, gap_documents.Diagnosis)

"""Document types of the report, whose keys all exist in the documents of the identification."""

import typing

import pytest
from pydantic import BaseModel

from bench.campaign_report import causes
from bench.report import diagnosis, discovery, documents, truth
from identification.damper.effects import Place, Variable
from identification.documents import diagnosis as gap_documents
from identification.documents import fit, trend
from sim_rig import hidden_effect


def find_document_type(annotation):
    """Return the document type inside an annotation, or None."""
    inside = (annotation, *typing.get_args(annotation))
    return next((kind for kind in inside if isinstance(kind, type) and issubclass(kind, BaseModel)), None)


def assert_within(read, written):
    assert set(read.model_fields) <= set(written.model_fields)
    for name, field in read.model_fields.items():
        if (inner := find_document_type(field.annotation)) is not None:
            assert_within(inner, find_document_type(written.model_fields[name].annotation))


@pytest.mark.parametrize("name", ["Fit", "Prediction"])
def test_every_key_that_a_report_reads_is_written(name):
    assert_within(getattr(documents, name), getattr(fit, name))


def test_every_key_of_a_diagnosis_that_a_report_reads_is_written():
    assert_within(diagnosis.Diagnosis, gap_documents.Diagnosis)


def test_every_key_of_a_trend_that_a_campaign_report_reads_is_written():
    assert_within(causes.TrendDocument, trend.Trend)


def test_every_key_of_a_truth_that_a_report_reads_is_written():
    assert_within(truth.Truth, hidden_effect.Truth)


def test_a_report_has_a_label_for_every_place_and_a_unit_for_every_variable():
    assert set(discovery.PLACE_QUANTITIES) == set(typing.get_args(Place))
    assert set(discovery.VARIABLE_UNITS) == set(typing.get_args(Variable))

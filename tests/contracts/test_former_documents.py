"""Documents of commit 47f8566 can be read, and are written again under the present names."""

import json
from pathlib import Path

import pytest

from bench.report.diagnosis import read_diagnosis
from bench.report.documents import Fit as ReportFit
from bench.report.documents import read_document
from identification.documents import DesignReport, Diagnosis, Fit, Forecast, Prediction, Trend, Twin
from identification.fitting import read_fit_or_model

FOLDER = Path(__file__).parent / "documents_47f8566"
TYPES = {
    "diagnosis": Diagnosis,
    "fit": Fit,
    "fit_two_logs": Fit,
    "forecast": Forecast,
    "foresight": DesignReport,
    "prediction": Prediction,
    "trend": Trend,
    "twin": Twin,
}
RENAMED = {
    "diagnosis": {"witness": "cross_check", "agrees": "consistent", "said": "message"},
    "fit": {"how": "basis", "each_log": "per_log"},
    "fit_two_logs": {"how": "basis", "each_log": "per_log"},
    "forecast": {"inside": "coverage"},
    "foresight": {"percent": "deviation_percent", "fixed": "identifiable", "add": "proposal"},
    "prediction": {"inside": "coverage"},
    "trend": {"way": "direction", "per_run": "change_per_run", "sizes": "values"},
    "twin": {"how": "basis", "each_log": "per_log"},
}
"""Former and present keys of each document; keys with two meanings have tests of their own."""


def rename_keys(content, names):
    if isinstance(content, dict):
        return {names.get(key, key): rename_keys(value, names) for key, value in content.items()}
    return [rename_keys(value, names) for value in content] if isinstance(content, list) else content


def read(name):
    return TYPES[name].model_validate_json((FOLDER / f"{name}.json").read_bytes())


def write(document):
    # Fields that were added since are absent in a former document.
    return json.loads(document.model_dump_json(by_alias=True, exclude_unset=True))


@pytest.mark.parametrize("name", sorted(TYPES.keys() - {"foresight", "trend"}))
def test_a_former_document_is_written_again_with_the_same_values_under_present_names(name):
    former = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    assert write(read(name)) == rename_keys(former, RENAMED[name])


def test_a_former_trend_has_directions_under_present_names():
    former = json.loads((FOLDER / "trend.json").read_text(encoding="utf-8"))
    assert {change["way"] for change in former["changes"]} == {"falls", "steady"}
    expected = rename_keys(former, RENAMED["trend"])
    for change in expected["changes"]:
        change["direction"] = {"falls": "falling", "steady": "steady"}[change["direction"]]
    assert write(read("trend")) == expected
    assert (
        Trend.model_validate(former | {"changes": [former["changes"][0] | {"way": "grows"}]}).changes[0].direction
        == "rising"
    )


def test_a_former_design_report_has_a_proposal_and_messages():
    former = json.loads((FOLDER / "foresight.json").read_text(encoding="utf-8"))
    lines, message = former.pop("words"), former["add"].pop("words")
    expected = rename_keys(former, RENAMED["foresight"]) | {"messages": lines}
    expected["proposal"]["message"] = message
    assert write(read("foresight")) == expected


@pytest.mark.parametrize(("name", "effects"), [("fit", ()), ("twin", ("gas_spring",))])
def test_a_former_fit_and_twin_can_be_simulated(name, effects):
    model = read_fit_or_model(FOLDER / f"{name}.json")
    assert tuple(entry.effect.name for entry in getattr(model, "effects", ())) == effects


def test_a_report_shows_former_documents():
    assert read_document(FOLDER / "fit.json", ReportFit, "a fit").floor.basis
    assert "agrees" in read_diagnosis(FOLDER / "diagnosis.json").cross_check.message

"""Dry run of stored and inline methods."""

import pytest

from bench.errors import RunError
from bench.methods import load_method
from bench.service.routes.planning import assessments

DESIGN = {"schema": "mrbench.foresight/1", "messages": ["k0 to 3 %"]}


@pytest.fixture
def assessed(monkeypatch):
    calls = []
    monkeypatch.setattr(assessments, "assess_design", lambda programme, command: calls.append(command) or DESIGN)
    assessments._assess.cache_clear()
    yield calls
    assessments._assess.cache_clear()


def test_the_forecast_names_peaks_heat_disk_and_identifiability(service, assessed):
    found = service.post("/methods/dry-run", {"method": "quick"}, 200)
    total = found["envelope"]["total"]
    assert total["duration_s"] == pytest.approx(23.1)
    assert 0.09 < total["velocity_mps"] < 0.1
    assert found["mean_heat_w"] == pytest.approx(found["envelope"]["heat_j"] / total["duration_s"])
    assert 0 < found["mean_heat_w"] < total["force_n"] * total["velocity_mps"]
    assert found["envelope"]["design"] == DESIGN
    assert found["bench"]["limits"]["force"]["trip"] == 5000.0
    assert found["bench"]["obstacles"] == []
    assert found["bench"]["log_bytes"] > 1e6
    assert len(found["checkpoints"]) == 2
    assert found["preview"]["duration_s"] == pytest.approx(23.1)


def test_an_equal_content_is_assessed_once_at_the_lowest_priority(service, assessed):
    document = load_method("quick").model_dump(mode="json", by_alias=True, exclude_defaults=True)
    for method in ("quick", document, "quick"):
        service.post("/methods/dry-run", {"method": method}, 200)
    assert len(assessed) == 1
    assert assessed[0][:3] == ("nice", "-n", "19")
    service.post("/methods/dry-run", {"method": "validation", "identifiability": False}, 200)
    assert len(assessed) == 1


def test_a_limit_of_the_bench_is_compared_with_the_peak(service, assessed):
    limit = service.agent.description.limits["force"].model_copy(update={"controlled_stop": 300.0})
    service.agent.description = service.agent.description.model_copy(update={"limits": {"force": limit}})
    obstacles = service.post("/methods/dry-run", {"method": "quick"}, 200)["bench"]["obstacles"]
    assert obstacles == ["force 647.9 N exceeds the bench's 300 N"]


def test_without_a_bench_or_an_assessment_the_reason_is_given(service, assessed, monkeypatch):
    def fail(programme, command):
        raise RunError("the planned strokes were not assessed: no such command")

    monkeypatch.setattr(assessments, "assess_design", fail)
    service.agent.reachable = False
    found = service.post("/methods/dry-run", {"method": "quick"}, 200)
    assert found["bench"]["unknown"].startswith("no rig agent answered")
    assert found["identifiability_error"].endswith("no such command")
    assert found["envelope"]["design"] is None


def test_an_invalid_document_is_refused_with_its_place(service):
    answer = service.post("/methods/dry-run", {"method": {"schema": "mrbench.method/1"}}, 422)
    assert answer["type"] == "urn:mrbench:problem:method-refused"

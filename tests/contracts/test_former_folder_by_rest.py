"""A data folder of commit 47f8566, with its catalogue and a log, is served by the REST interface."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.unit.bench.service.conftest import Service

FOLDER = Path(__file__).parent / "documents_47f8566"
RUN = "20261123T070056.531435Z-short"
KILLED = "20261123T070201.386846Z-short"


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    """Return a service on a copy of the folder; its start migrates the catalogue."""
    data = tmp_path_factory.mktemp("former")
    for name in ("catalogue.db", "run.mcap"):
        shutil.copy(FOLDER / name, data / name)
    started = Service(data)
    started.start()
    yield started
    started.end()


def test_former_runs_are_listed_with_their_states(service):
    found = {run["id"]: (run["log"], run["state"], run["outcome"]) for run in service.get("/runs")["items"]}
    assert found == {RUN: ("run.mcap", "ended", "clean"), KILLED: ("killed.mcap", "truncated", None)}


def test_a_former_run_is_shown_with_its_facts_and_its_job(service):
    run = service.get(f"/runs/{RUN}")
    expected = {"specimen": "D7", "operator": "anna", "method": "short", "ending": "completed", "source": "run"}
    assert {name: run[name] for name in expected} == expected
    assert run["tags"] == []
    assert run["duration_s"] == pytest.approx(2.6)
    assert [(job["id"], job["kind"]) for job in run["jobs"]] == [("job1", "identify")]
    assert service.get("/specimens/D7")["runs"] == 1


def test_a_former_killed_run_names_its_repair_and_its_missing_log(service):
    run = service.get(f"/runs/{KILLED}")
    assert run["ending"] is None
    assert "salvage" in run["reason"]
    answer = service.client.get(f"/api/v1/runs/{KILLED}/samples")
    assert answer.status_code == 409
    assert "killed.mcap: no such file" in answer.json()["detail"]


def test_the_samples_of_a_former_run_have_names_units_and_values(service):
    found = service.get(f"/runs/{RUN}/samples?channel=displacement&channel=force&points=0")
    assert found["channels"] == [{"name": "displacement", "unit": "m"}, {"name": "force", "unit": "N"}]
    displacement, force = (np.array(found["values"][name]) for name in ("displacement", "force"))
    assert np.ptp(displacement) == pytest.approx(0.01, rel=0.02)
    assert len(force) == len(displacement) == found["samples"]
    assert np.isfinite(force).all()
    segments = service.get(f"/runs/{RUN}/segments")["items"]
    assert [one["name"] for one in segments] == ["5mm_2.5Hz_0.1V", "5mm_2.5Hz_0.5V"]


def test_the_report_on_a_former_run_is_made(service):
    answer = service.client.get(f"/api/v1/runs/{RUN}/report")
    assert (answer.status_code, answer.headers["content-type"]) == (200, "text/html; charset=utf-8")
    assert all(fact in answer.text for fact in (RUN, "D7", "anna", "651 samples"))

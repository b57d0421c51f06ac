"""Parameters and trend of a specimen over its runs."""

import json

from bench.jobs import FIT_FILE, TREND_FILE
from tests.unit.bench.service.routes.planning.test_specimens import add_run

SUMMARY = {"result": "converged", "rmse_n": 2.5, "held_out_rmse_n": None, "noise_floor_n": 2.4}
K0 = {"value": 900.0, "unit": "N/m", "ci95": [880.0, 920.0], "identifiable": True, "note": ""}


def test_a_trend_is_a_job_of_the_newest_run_and_its_document_is_returned(service):
    for number in range(3):
        add_run(service, number, "MR-1")
    job = service.post("/specimens/MR-1/trend", None, 201)
    assert (job["kind"], job["run"]) == ("trend", "run-2")
    assert job["settings"]["runs"] == ["run-0", "run-1", "run-2"]
    assert [path.rpartition("/")[2] for path in service.engine.specs[job["id"]].logs] == [
        "0.mcap",
        "1.mcap",
        "2.mcap",
    ]
    waiting = service.client.get("/api/v1/specimens/MR-1/trend")
    assert (waiting.status_code, "queued" in waiting.json()["detail"]) == (404, True)
    service.complete(job, {"changes": [], "explanation": "steady"}, {TREND_FILE: '{"specimen": "MR-1"}'})
    assert service.get("/specimens/MR-1/trend") == {"specimen": "MR-1"}
    assert service.post("/specimens/MR-1/trend", None, 200)["id"] == job["id"]


def test_a_trend_of_two_runs_is_refused_with_a_sentence(service):
    for number in range(2):
        add_run(service, number, "MR-1")
    assert "needs 3 runs" in service.post("/specimens/MR-1/trend", None, 409)["detail"]


def test_parameters_over_the_runs_have_units_and_intervals(service):
    add_run(service, 1, "MR-1")
    job = service.post("/runs/run-1/identify", None, 201)
    service.complete(job, SUMMARY, {FIT_FILE: json.dumps({"parameters": {"k0": K0}})})
    found = service.get("/specimens/MR-1/parameters")["items"]
    assert [(one["run"], one["fit"]) for one in found] == [("run-1", job["id"])]
    assert found[0]["parameters"]["k0"] == {name: K0[name] for name in ("value", "unit", "ci95", "identifiable")}

"""Jobs over REST: identification followed by diagnosis, queue, progress, retry, results by address."""

import csv
import io
import json
from urllib.parse import quote

import pytest

from bench.jobs.job_spec import DIAGNOSIS_FILE, FIT_FILE, REPORT_FILE, TWIN_FILE
from bench.jobs.progress import JobProgress
from tests.support.result_documents import estimate, fit_document
from tests.support.service_logs import write_complete_log

FIT = {"result": "converged", "rmse_n": 5.4, "held_out_rmse_n": None, "noise_floor_n": 2.4}
DIAGNOSIS = {
    "verdict": "explained", "effects": ["clevis_backlash"], "probability": 0.98, "before_n": 5.49, "after_n": 2.53,
    "noise_floor_n": 2.46, "shrinkage": 0.99, "shrinkage_ci95": [0.96, 1.0], "explanation": "A pin has play.",
}  # fmt: skip


@pytest.fixture
def run(service):
    """Return the id of an ended run whose identification is queued."""
    started = service.post("/runs", {"method": "quick", "specimen": "damper 7"}, 201)
    write_complete_log(service.data / started["log"], started["id"])
    service.agent.finish()
    service.wait_for(f"/runs/{started['id']}", lambda found: found["jobs"])
    return started["id"]


def jobs(service, run, kind):
    return [job for job in service.get(f"/runs/{run}")["jobs"] if job["kind"] == kind]


def complete_fit(service, job, name="fit 1"):
    service.complete(job, FIT, {FIT_FILE: json.dumps({"name": name}), REPORT_FILE: f"report of {name}"})


def complete_diagnosis(service, job):
    files = {
        DIAGNOSIS_FILE: '{"verdict": "explained"}',
        TWIN_FILE: '{"twin": 1}',
        REPORT_FILE: "fit and diagnosis",
    }
    service.complete(job, DIAGNOSIS, files)


def test_an_identified_run_is_diagnosed_and_its_answer_is_shown(service, run):
    (fit,) = jobs(service, run, "identify")
    complete_fit(service, fit)
    (diagnosis,) = jobs(service, run, "diagnose")
    assert diagnosis["state"] == "queued"
    assert service.get(f"/runs/{run}")["diagnosis"] is None
    assert service.client.get(f"/api/v1/runs/{run}/report").text == "report of fit 1"
    assert "its newest job is queued" in service.client.get(f"/api/v1/runs/{run}/diagnosis").json()["detail"]
    complete_diagnosis(service, diagnosis)
    assert service.get(f"/runs/{run}")["diagnosis"] == {"id": diagnosis["id"], **DIAGNOSIS}
    assert service.get(f"/runs/{run}")["rmse_n"] == 5.4
    for path in (f"/runs/{run}/diagnosis", f"/diagnoses/{diagnosis['id']}"):
        assert service.get(path) == {"verdict": "explained"}
    assert service.get(f"/twins/{diagnosis['id']}") == {"twin": 1}
    assert service.client.get(f"/api/v1/runs/{run}/report").text == "fit and diagnosis"


def test_each_fit_has_its_address_and_a_cancelled_job_hides_no_result(service, run):
    (first,) = jobs(service, run, "identify")
    complete_fit(service, first)
    second = service.post(f"/runs/{run}/identify", {"hold_out_after": 0.8}, 201)
    complete_fit(service, second, "fit 2")
    third = service.post(f"/runs/{run}/identify", {"hold_out_after": 0.7}, 201)
    service.post(f"/jobs/{third['id']}/cancel")
    assert service.get(f"/fits/{first['id']}") == {"name": "fit 1"}
    assert service.get(f"/runs/{run}/fit") == service.get(f"/fits/{second['id']}") == {"name": "fit 2"}
    assert len(jobs(service, run, "identify")) == 3
    assert service.get(f"/runs/{run}")["rmse_n"] == 5.4


@pytest.mark.parametrize("path", ["/fits/{}", "/diagnoses/{}", "/twins/{}"])
def test_an_id_of_another_kind_or_of_an_unfinished_job_is_not_found(service, run, path):
    (fit,) = jobs(service, run, "identify")
    for job_id in ("unknown", quote("a/b"), fit["id"]):
        assert service.client.get("/api/v1" + path.format(job_id)).status_code == 404


def test_a_diagnosis_can_be_requested_with_settings_and_is_not_repeated(service, run):
    asked = service.post(f"/runs/{run}/diagnose", {"discover": True}, 201)
    assert (asked["kind"], asked["settings"]["discover"]) == ("diagnose", True)
    assert service.post(f"/runs/{run}/diagnose", {"discover": True})["id"] == asked["id"]
    refused = service.client.post(f"/api/v1/runs/{run}/diagnose", json={"model": "unknown"})
    assert refused.status_code == 409
    assert "no fit or diagnosis unknown" in refused.json()["detail"]


def test_stage_and_fraction_of_a_running_job_are_shown(service, run):
    (job,) = jobs(service, run, "identify")
    assert (job["stage"], job["fraction"]) == ("", None)
    service.report("on_started", job["id"])
    service.report("on_progress", job["id"], JobProgress("refine", 0.4, "identify: refine, force error 3.1 N"))
    found = service.get(f"/jobs/{job['id']}")
    assert (found["stage"], found["fraction"]) == ("refine", 0.4)
    assert found["activity"] == "identify: refine, force error 3.1 N"


def test_the_queue_is_shown_with_the_place_of_each_job(service, run):
    (first,) = jobs(service, run, "identify")
    second, third = (service.post(f"/runs/{run}/identify", {"hold_out_after": part}, 201) for part in (0.8, 0.9))
    service.report("on_started", first["id"])
    waiting = service.get("/jobs?state=queued")["items"]
    assert {job["id"]: job["position"] for job in waiting} == {second["id"]: 1, third["id"]: 2}
    busy = service.get("/jobs?state=queued&state=running")["items"]
    assert [job["position"] for job in busy] == [2, 1, None]
    assert service.get(f"/jobs?kind=diagnose&run={run}")["items"] == []
    assert service.client.get("/api/v1/jobs?state=lost").status_code == 422


def test_jobs_are_listed_page_by_page(service, run):
    for part in (0.7, 0.8, 0.9):
        service.post(f"/runs/{run}/identify", {"hold_out_after": part}, 201)
    first = service.get("/jobs?limit=3")
    second = service.get(f"/jobs?limit=3&before={first['next']}")
    assert (len(first["items"]), len(second["items"]), second["next"]) == (3, 1, None)


def test_a_failed_job_is_repeated_with_a_reason_under_its_id(service, run):
    (job,) = jobs(service, run, "identify")
    path = f"/jobs/{job['id']}/retry"
    assert service.client.post(f"/api/v1{path}", json={"reason": "now"}).status_code == 409
    service.report("on_started", job["id"])
    service.report("on_failed", job["id"], "the disk is full")
    assert service.client.post(f"/api/v1{path}", json={}).status_code == 422
    repeated = service.post(path, {"reason": "the disk has space again"})
    assert (repeated["id"], repeated["state"], repeated["attempts"]) == (job["id"], "queued", 1)
    (entry,) = repeated["retries"]
    assert (entry["reason"], entry["error"]) == ("the disk has space again", "the disk is full")
    assert service.engine.specs[job["id"]].submission == 2
    complete_fit(service, job)
    assert service.get(f"/jobs/{job['id']}")["attempts"] == 2


def test_a_batch_queues_a_job_for_each_run_and_has_one_table(service, run):
    (fit,) = jobs(service, run, "identify")
    batch = service.post("/batches", {"kind": "identify", "runs": [run, "unknown", run]}, 201)
    assert [(row["run"], row["job"], row["state"]) for row in batch["rows"]] == [
        (run, fit["id"], "queued"),
        ("unknown", "", "refused"),
    ]
    assert "there is no run unknown" in batch["rows"][1]["error"]
    assert batch["unfinished"] == 1
    complete_fit(service, fit)
    found = service.get(f"/batches/{batch['id']}")
    assert found["unfinished"] == 0
    assert found["rows"][0]["rmse_n"] == 5.4
    table = service.client.get(f"/api/v1/batches/{batch['id']}/table")
    assert table.headers["content-type"].startswith("text/csv")
    rows = list(csv.DictReader(io.StringIO(table.text)))
    assert (rows[0]["specimen"], rows[0]["state"], float(rows[0]["rmse_n"])) == ("damper 7", "done", 5.4)
    assert rows[1]["state"] == "refused"


def test_the_table_of_a_batch_of_diagnoses_names_their_effects(service, run):
    batch = service.post("/batches", {"kind": "diagnose", "runs": [run], "settings": {"discover": True}}, 201)
    complete_diagnosis(service, {"id": batch["rows"][0]["job"]})
    (row,) = service.get(f"/batches/{batch['id']}")["rows"]
    assert (row["verdict"], row["effects"], row["shrinkage"]) == ("explained", ["clevis_backlash"], 0.99)


def test_wrong_settings_of_a_batch_are_refused_by_name_and_queue_nothing(service, run):
    refused = service.client.post(
        "/api/v1/batches", json={"kind": "diagnose", "runs": [run], "settings": {"stages": ["pinn"]}}
    )
    assert refused.status_code == 422
    assert "settings.stages" in refused.json()["detail"]
    assert service.get("/jobs?kind=diagnose")["items"] == []
    assert service.client.get("/api/v1/batches/unknown").status_code == 404


def test_the_changes_since_the_result_of_another_version_are_shown(service, run):
    (first,) = jobs(service, run, "identify")
    texts = [
        json.dumps(fit_document(parameters={"k0": estimate(value, "N/m", [value - 1, value + 1])}))
        for value in (10.0, 20.0)
    ]
    service.complete(first, FIT, {FIT_FILE: texts[0], REPORT_FILE: ""})
    second = service.post(f"/runs/{run}/identify", {"hold_out_after": 0.8}, 201)
    service.complete(second, FIT, {FIT_FILE: texts[1], REPORT_FILE: ""})
    path = f"/jobs/{second['id']}/changes"
    assert "another version" in service.client.get(f"/api/v1{path}").json()["detail"]
    changes = service.get(f"{path}?since={first['id']}")
    assert [(one["name"], one["older"], one["newer"], one["changed"]) for one in changes["parameters"]] == [
        ("k0", 10.0, 20.0, True)
    ]
    service.client.app.state.context.catalogue.update_job(first["id"], ("done",), version="0.0.9")
    assert service.get(path)["older"] == first["id"]

"""Comparisons, predictions and series by the REST interface."""

import json
import os

import numpy as np
import pytest

from bench.calibration import make_log_text
from tests.support.certificates import issue_certificate
from tests.support.cyclic_logs import write_cyclic_log
from tests.support.reports import prediction
from tests.support.result_documents import fit_document
from tests.support.service_logs import STARTED, write_complete_log, write_truncated_log

API = "/api/v1"


@pytest.fixture
def service(service):
    """Return a service with two recorded runs."""
    for name, gain in (("a", 1.0), ("b", 1.3)):
        write_cyclic_log(service.data / f"{name}.mcap", name, gain=gain)
    service.scan()
    return service


def write_series(folder, width=5.0):
    time = np.arange(2000) / 500.0
    force = np.sin(time)
    info = np.array(json.dumps({"stretches": ["quick"], "drive_unit": "V"}))
    columns = dict.fromkeys(("displacement", "velocity", "drive", "force"), force)
    band = {"lower": force - width, "upper": force + width}
    held_out = np.zeros(2000, bool)
    np.savez(
        folder / "series.npz", time=time, info=info, held_out=held_out, simulated=force + 2.0, **columns, **band
    )


def identify(service, run):
    """Complete the identification of a run, and return its job."""
    (job,) = service.get(f"/runs/{run}")["jobs"][:1]
    service.complete(job, {"rmse_n": 2.0, "noise_floor_n": 1.9}, {"fit.json": json.dumps(fit_document())})
    return job


def get_folder(service, job):
    return service.data / service.client.app.state.context.catalogue.get_job(job["id"]).result


def test_two_runs_are_compared_at_an_address_and_by_a_request(service):
    found = service.get("/comparisons?run=a&run=b&reference=a&tolerance_percent=5")
    assert [run["run"] for run in found["runs"]] == ["a", "b"]
    assert [stroke["name"] for stroke in found["strokes"]] == ["0.1V", "0.3V"]
    assert {verdict["result"] for verdict in found["verdicts"]} == {"fail"}
    body = {"runs": ["a", "b"], "reference": "a", "tolerance_percent": 5}
    assert service.post("/comparisons", body) == found


def test_the_band_contains_the_uncertainty_of_the_fit(service):
    job = identify(service, "a")
    write_series(get_folder(service, job), width=500.0)
    found = service.get("/comparisons?run=a&run=b&reference=a&tolerance_percent=5")
    assert found["runs"][0]["fit"] == job["id"]
    assert found["strokes"][0]["band"]["model_uncertainty_n"] == pytest.approx(500.0)
    assert {verdict["result"] for verdict in found["verdicts"]} == {"pass"}


def test_a_run_with_a_truncated_log_is_named_and_the_answer_says_what_to_do(service):
    log = write_truncated_log(service.data / "c.mcap", "c")
    os.utime(log, (1.0, 1.0))  # nobody is writing it
    service.scan()
    answer = service.client.get(f"{API}/comparisons?run=a&run=b&run=c")
    assert answer.status_code == 409
    assert answer.json()["detail"].startswith("run c: ")
    assert "salvage" in answer.json()["detail"]
    assert answer.json()["detail"].endswith("or compare without this run")


@pytest.mark.parametrize(
    ("query", "status", "message"),
    [
        ("run=a", 422, "run"),
        ("run=a&run=a", 422, "named twice"),
        ("run=a&run=b&reference=c", 422, "c is not among the runs"),
        ("run=a&run=b&tolerance_percent=0", 422, "tolerance_percent"),
        ("run=a&run=c", 404, "there is no run c"),
    ],
)
def test_a_wrong_comparison_is_refused(service, query, status, message):
    answer = service.client.get(f"{API}/comparisons?{query}")
    assert answer.status_code == status
    assert message in answer.json()["detail"]


def test_the_series_of_a_fit_has_the_error_of_each_segment(service):
    job = identify(service, "a")
    write_series(get_folder(service, job))
    found = service.get(f"/fits/{job['id']}/series?points=50")
    assert (found["run"], found["samples"], found["decimated"]) == ("a", 2000, True)
    assert [error["segment"] for error in found["errors"]] == ["0.1V", "0.3V"]
    assert [error["rmse_n"] for error in found["errors"]] == [pytest.approx(2.0)] * 2
    whole = service.get(f"/fits/{job['id']}/series?from=1&to=1.5&points=0")
    assert (whole["time"][0], whole["time"][-1], len(whole["time"])) == (1.0, 1.5, 251)
    assert set(whole["values"]) >= {"force", "simulated", "displacement", "velocity", "lower", "upper"}


def test_a_fit_without_series_says_what_to_do(service):
    job = identify(service, "a")
    answer = service.client.get(f"{API}/fits/{job['id']}/series")
    assert answer.status_code == 404
    assert "/runs/a/predict" in answer.json()["detail"]


def test_a_fit_is_predicted_on_another_run(service):
    model = identify(service, "a")
    job = service.post("/runs/b/predict", {"model": model["id"]}, 201)
    assert (job["kind"], job["run"]) == ("predict", "b")
    spec = (
        service.wait_for("/jobs", lambda page: job["id"] in service.engine.specs)
        and service.engine.specs[job["id"]]
    )
    assert spec.model.endswith("fit.json")
    document = prediction().model_dump_json(by_alias=True)
    service.complete(job, {"rmse_n": 2.0, "noise_floor_n": 1.9, "bias_n": 0.1}, {"prediction.json": document})
    assert service.get(f"/predictions/{job['id']}")["rmse_n"] == 2.0
    write_series(get_folder(service, job))
    assert service.get(f"/predictions/{job['id']}/series?points=10")["run"] == "b"
    assert service.get(f"/jobs/{job['id']}")["rmse_n"] == 2.0
    assert "prediction" in {file["kind"] for file in service.get("/runs/b/files")["items"]}
    assert service.client.get(f"{API}/fits/{job['id']}/series").status_code == 404


def test_a_prediction_of_an_unknown_model_is_refused(service):
    answer = service.client.post(f"{API}/runs/b/predict", json={"model": "nothing"})
    assert answer.status_code == 409
    assert "there is no fit or diagnosis nothing" in answer.json()["detail"]


def identify_with_certificate(service, of_this_log=True):
    """Return a run whose force has a certificate of 0.2 % standard uncertainty, with its fit."""
    text = make_log_text(issue_certificate(), STARTED.date(), "")
    write_complete_log(service.data / "calibrated.mcap", "calibrated", calibration={"force": text})
    service.scan()
    run = service.get("/runs/calibrated")
    document = fit_document(run["log_sha256"] if of_this_log else "5f" * 32)
    document["parameters"]["n"] = {"value": 2.0, "unit": "1", "ci95": [1.9, 2.1], "identifiable": True}
    service.complete(run["jobs"][0], {"rmse_n": 2.0, "noise_floor_n": 1.9}, {"fit.json": json.dumps(document)})
    return run["jobs"][0]["id"]


def test_the_intervals_of_a_fit_are_combined_with_the_calibration(service):
    fit = identify_with_certificate(service)
    found = service.get("/runs/calibrated/fit/calibration")
    assert (found["fit"], "JCGM 100:2008" in found["formula"]) == (fit, True)
    yield_force = found["coordinates"]["F_a"]
    assert (yield_force["value"], yield_force["calibration"]) == (44.862, pytest.approx(0.002))
    assert yield_force["ci95"][0] == pytest.approx(44.862 - np.hypot(0.096, 1.96 * 0.002 * 44.862))
    assert (found["parameters"]["alpha_a"]["ci95"], found["parameters"]["alpha_a"]["missing"]) == (
        None,
        ["displacement"],
    )
    assert found["parameters"]["n"]["ci95"] == [1.9, 2.1]
    assert service.get("/runs/calibrated/fit")["coordinates"]["F_a"]["ci95"] == [44.766, 44.959]


def test_a_fit_of_other_logs_has_no_calibration(service):
    identify_with_certificate(service, of_this_log=False)
    answer = service.client.get(f"{API}/runs/calibrated/fit/calibration")
    assert (answer.status_code, answer.json()["type"]) == (409, "urn:mrbench:problem:several-logs")


def test_a_run_without_a_fit_has_no_calibrated_intervals(service):
    assert service.client.get(f"{API}/runs/a/fit/calibration").status_code == 404

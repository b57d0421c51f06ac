"""Run from its start to its fit, by the REST interface."""

from pathlib import Path

import pytest

from bench.jobs.job_spec import FIT_FILE, REPORT_FILE
from tests.support.service_logs import STARTED, write_complete_log, write_truncated_log

SUMMARY = {"result": "converged", "rmse_n": 2.5, "held_out_rmse_n": None, "noise_floor_n": 2.4}


def finish(service, run, outcome="clean"):
    write_complete_log(service.data / run["log"], run["id"], outcome)
    service.agent.finish(outcome)
    return service.wait_for(f"/runs/{run['id']}", lambda found: found["state"] == "ended")


def get_last_job(service, run):
    return service.wait_for(f"/runs/{run}", lambda found: found["jobs"])["jobs"][-1]


def complete(service, job):
    spec = service.engine.specs[job["id"]]
    service.report("on_started", job["id"])
    result = Path(spec.result)
    result.mkdir()
    (result / FIT_FILE).write_text('{"schema": "mrbench.fit/1"}')
    (result / REPORT_FILE).write_text("<!doctype html><title>report</title>")
    service.report("on_done", job["id"], SUMMARY)


def start(service, **more):
    return service.post("/runs", {"method": "quick", "specimen": "damper 7", "operator": "M. Curie", **more}, 201)


def test_methods_are_listed_and_returned_as_documents(service):
    quick = next(method for method in service.get("/methods") if method["name"] == "quick")
    assert quick["drive_kind"] == "coil_v"
    assert quick["duration_s"] == pytest.approx(23.1)
    document = service.get("/methods/quick")
    assert document["schema"] == "mrbench.method/1"
    assert service.post("/runs", {"method": document}, 201)["method"] == "quick"


def test_a_run_is_started_at_the_agent_and_catalogued_at_once(service):
    run = start(service)
    assert run["state"] == "running"
    assert (run["specimen"], run["operator"], run["method"]) == ("damper 7", "M. Curie", "quick")
    assert service.agent.commands[-1].method["name"] == "quick"
    assert service.agent.commands[-1].log == str(service.data / run["log"])
    assert [found["id"] for found in service.get("/runs")["items"]] == [run["id"]]


def test_progress_is_reported_during_a_run(service):
    run = start(service)
    service.agent.progress(11.5, "10mm_1Hz_0.2V")
    path = f"/runs/{run['id']}"
    found = service.wait_for(path, lambda found: found["progress"] and found["progress"]["elapsed_s"] > 0)
    assert found["progress"] == {"elapsed_s": 11.5, "duration_s": 23.1, "segment": "10mm_1Hz_0.2V"}
    assert finish(service, run)["progress"] is None


@pytest.mark.parametrize("outcome", ["clean", "lossy"])
def test_a_finished_run_is_identified_and_its_files_are_served(service, outcome):
    run = start(service)
    ended = finish(service, run, outcome)
    assert ended["outcome"] == outcome
    assert ended["duration_s"] == pytest.approx(1.998)
    job = get_last_job(service, run["id"])
    assert job["state"] == "queued"
    complete(service, job)
    found = service.get(f"/runs/{run['id']}")
    assert (found["rmse_n"], found["noise_floor_n"], found["result"]) == (2.5, 2.4, "converged")
    assert found["jobs"][0]["state"] == "done"
    assert found["jobs"][0]["attempts"] == 1
    assert service.get(f"/runs/{run['id']}/fit")["schema"] == "mrbench.fit/1"
    page = service.client.get(f"/api/v1/runs/{run['id']}/report")
    assert page.headers["content-type"].startswith("text/html")
    log = service.client.get(f"/api/v1/runs/{run['id']}/log")
    assert log.content == (service.data / run["log"]).read_bytes()
    assert run["log"] in log.headers["content-disposition"]


def test_an_incomplete_run_is_catalogued_and_not_identified(service):
    run = start(service)
    assert finish(service, run, "incomplete")["reason"] == "stopped by the test"
    service.wait_for(f"/runs/{run['id']}", lambda found: found["outcome"] == "incomplete")
    assert service.engine.specs == {}


def test_an_equal_job_is_not_created_twice(service):
    run = start(service)
    finish(service, run)
    job = get_last_job(service, run["id"])
    assert service.post(f"/runs/{run['id']}/identify")["id"] == job["id"]
    complete(service, job)
    assert service.post(f"/runs/{run['id']}/identify")["id"] == job["id"]
    other = service.post(f"/runs/{run['id']}/identify", {"hold_out_after": 0.8}, 201)
    assert other["id"] != job["id"]
    assert service.engine.specs[other["id"]].key != service.engine.specs[job["id"]].key


def test_a_failed_job_has_a_reason_and_can_be_requested_again(service):
    run = start(service)
    finish(service, run)
    job = get_last_job(service, run["id"])
    service.report("on_started", job["id"])
    service.report("on_failed", job["id"], "identify: too little is left to fit")
    assert service.get(f"/jobs/{job['id']}")["error"] == "identify: too little is left to fit"
    detail = service.client.get(f"/api/v1/runs/{run['id']}/fit").json()["detail"]
    assert "too little is left to fit" in detail
    again = service.post(f"/runs/{run['id']}/identify", status=201)
    assert again["id"] != job["id"]


def test_a_queued_job_is_cancelled_at_once_and_a_running_one_when_it_has_stopped(service):
    run = start(service)
    finish(service, run)
    waiting = get_last_job(service, run["id"])
    assert service.post(f"/jobs/{waiting['id']}/cancel")["state"] == "cancelled"
    running = service.post(f"/runs/{run['id']}/identify", status=201)
    service.report("on_started", running["id"])
    assert service.post(f"/jobs/{running['id']}/cancel")["state"] == "running"
    service.report("on_cancelled", running["id"])
    assert service.get(f"/jobs/{running['id']}")["state"] == "cancelled"
    assert service.engine.cancelled == [(waiting["id"], False), (running["id"], True)]
    assert service.client.post(f"/api/v1/jobs/{running['id']}/cancel").status_code == 409


def test_a_cancelled_job_stays_cancelled(service):
    run = start(service)
    finish(service, run)
    job = get_last_job(service, run["id"])
    service.post(f"/jobs/{job['id']}/cancel")
    service.report("on_started", job["id"])
    service.report("on_done", job["id"], SUMMARY)
    assert service.get(f"/jobs/{job['id']}")["state"] == "cancelled"


def test_a_job_that_never_ends_fails_after_three_attempts(service):
    run = start(service)
    finish(service, run)
    job = get_last_job(service, run["id"])
    for _ in range(3):
        service.report("on_started", job["id"])
    assert service.get(f"/jobs/{job['id']}")["attempts"] == 3
    service.report("on_started", job["id"])
    found = service.get(f"/jobs/{job['id']}")
    assert (found["state"], found["attempts"]) == ("failed", 3)
    assert "3 times" in found["error"]
    assert service.engine.cancelled == [(job["id"], True)]


def test_stop_is_sent_to_the_agent_unless_another_run_is_in_progress(service):
    run = start(service)
    assert service.post(f"/runs/{run['id']}/stop")["state"] == "stopping"
    assert service.agent.commands[-1].command == "stop"
    commands = len(service.agent.commands)
    assert service.client.post("/api/v1/runs/another/stop").status_code == 409
    assert len(service.agent.commands) == commands


def test_runs_are_listed_newest_first_page_by_page(service):
    for _ in range(5):
        run = start(service)
        finish(service, run)
    pages, before = [], ""
    while before is not None:
        page = service.get(f"/runs?limit=2{before and '&before=' + before}")
        pages.append([found["id"] for found in page["items"]])
        before = page["next"]
    assert pages == [["run-5", "run-4"], ["run-3", "run-2"], ["run-1"]]
    assert service.client.get("/api/v1/runs?before=none").status_code == 404


def test_jobs_are_listed_newest_first(service):
    run = start(service)
    finish(service, run)
    first = get_last_job(service, run["id"])
    second = service.post(f"/runs/{run['id']}/identify", {"budget_s": 5}, 201)
    assert [job["id"] for job in service.get("/jobs")["items"]] == [second["id"], first["id"]]
    assert [job["id"] for job in service.get(f"/runs/{run['id']}")["jobs"]] == [first["id"], second["id"]]
    assert service.get("/jobs")["items"][0]["settings"]["budget_s"] == 5


def test_a_remote_agent_chooses_the_file_of_the_log(service):
    service.start(has_local_logs=False)
    run = start(service)
    assert service.agent.commands[-1].log is None
    service.agent.finish("clean")
    service.wait_for(f"/runs/{run['id']}", lambda found: found["outcome"] == "clean")
    assert service.client.get(f"/api/v1/runs/{run['id']}/log").status_code == 404
    assert service.client.post(f"/api/v1/runs/{run['id']}/identify").status_code == 409


def test_a_run_that_ended_while_the_service_was_down_is_found(service):
    run = start(service)
    service.end()
    write_complete_log(service.data / run["log"], run["id"])
    service.agent.finish()
    service.start()
    found = service.wait_for(f"/runs/{run['id']}", lambda found: found["outcome"])
    assert found["outcome"] == "clean"
    assert get_last_job(service, run["id"])["state"] == "queued"


def test_a_log_from_elsewhere_is_found(service):
    service.end()
    write_complete_log(service.data / "from_elsewhere.mcap", "foreign", first_s=3600.0)
    write_complete_log(service.data / "bought.mcap", "bought.csv", source="import", started=None)
    service.start()
    service.wait_for("/runs", lambda found: len(found["items"]) == 2)
    found = service.wait_for("/runs/foreign", lambda found: found["jobs"])
    assert found["started"] == STARTED.replace(hour=11).isoformat().replace("+00:00", "Z")
    imported = service.get("/runs/bought")
    assert (imported["source"], imported["jobs"]) == ("import", [])
    assert service.post("/runs/bought/identify", status=201)["state"] == "queued"


def test_a_truncated_log_is_flagged_and_can_be_repaired(service):
    run = start(service)
    service.end()
    write_truncated_log(service.data / run["log"], run["id"])
    service.agent.forget()
    service.start()
    service.agent.publish()
    found = service.wait_for(f"/runs/{run['id']}", lambda found: found["state"] == "truncated")
    assert "salvage" in found["reason"]
    assert service.client.post(f"/api/v1/runs/{run['id']}/identify").status_code == 409
    repaired = service.post(f"/runs/{run['id']}/salvage")
    assert (repaired["state"], repaired["outcome"]) == ("ended", "truncated")
    assert service.post(f"/runs/{run['id']}/identify", status=201)["state"] == "queued"
    assert service.client.post(f"/api/v1/runs/{run['id']}/salvage").status_code == 409


def test_a_run_without_a_log_counts_as_ended(service):
    run = start(service)
    service.agent.forget()
    service.end()
    service.start()
    service.agent.publish()
    found = service.wait_for(f"/runs/{run['id']}", lambda found: found["state"] == "ended")
    assert found["outcome"] == "incomplete"
    assert "before it wrote a log" in found["reason"]


def test_unfinished_jobs_are_submitted_again_under_their_key(service):
    run = start(service)
    finish(service, run)
    job = get_last_job(service, run["id"])
    service.report("on_started", job["id"])
    key = service.engine.specs[job["id"]].key
    service.start()
    assert service.engine.specs[job["id"]].key == key
    service.report("on_started", job["id"])
    assert service.get(f"/jobs/{job['id']}")["attempts"] == 2
    complete_folder = service.engine.specs[job["id"]].result
    assert complete_folder == str(service.data / f"{run['log'].removesuffix('.mcap')}.fit-{key[:12]}")


def test_a_move_without_a_target_is_refused_and_not_sent(service):
    answer = service.client.post("/api/v1/agent/prepare", json={"step": "move"})
    assert answer.status_code == 422
    assert "move needs position_m" in answer.json()["detail"]
    assert service.agent.commands == []
    service.post("/agent/prepare", {"step": "move", "position_m": 0.0})
    service.post("/agent/prepare", {"step": "tare"})
    assert [(one.step, one.position_m) for one in service.agent.commands] == [("move", 0.0), ("tare", None)]

"""Run from its start to its fit, by the REST interface."""

import os
from datetime import timedelta

import pytest

from bench.calibration import list_overdue, make_log_text
from bench.catalogue import CatalogueUnavailableError, JobRow, RunRow
from bench.catalogue.catalogue import Catalogue
from bench.catalogue.scan import catalogue_log
from bench.jobs.job_spec import FIT_FILE, REPORT_FILE
from bench.jobs.scheduler import MAX_ATTEMPTS
from bench.service.routes import runs
from tests.support.certificates import issue_certificate, make_certificate, shift
from tests.support.service_logs import STARTED, write_complete_log, write_empty_log, write_truncated_log
from tests.support.waiting import wait_until

PAGE = "<!doctype html><title>report</title>"
SUMMARY = {"result": "converged", "rmse_n": 2.5, "held_out_rmse_n": None, "noise_floor_n": 2.4}


def finish(service, run, outcome="clean"):
    write_complete_log(service.data / run["log"], run["id"], outcome)
    service.agent.finish(outcome)
    return service.wait_for(f"/runs/{run['id']}", lambda found: found["state"] == "ended")


def get_last_job(service, run):
    """Return the last job of a run, once the engine has it: its row is in the catalogue earlier."""
    return service.wait_for(
        f"/runs/{run}", lambda found: found["jobs"] and found["jobs"][-1]["id"] in service.engine.specs
    )["jobs"][-1]


def complete(service, job):
    service.complete(job, SUMMARY, {FIT_FILE: '{"schema": "mrbench.fit/1"}', REPORT_FILE: PAGE})


def start(service, **more):
    return service.post("/runs", {"method": "quick", "specimen": "damper 7", "operator": "M. Curie", **more}, 201)


def test_methods_are_listed_and_returned_as_documents(service):
    quick = next(method for method in service.get("/methods")["items"] if method["name"] == "quick")
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


def test_the_agent_gets_the_certificates_that_apply(service):
    old = make_certificate(number="1", date=shift(-700), due=shift(-400))
    for document in (old, make_certificate(), make_certificate("displacement", "m", date=shift(1))):
        service.post("/certificates", document, 201)
    start(service)
    (issued,) = service.agent.commands[-1].certificates
    assert (issued.document.channel, issued.document.number, issued.version) == ("force", "4711", 1)


def test_a_run_with_an_overdue_channel_is_marked_from_its_start_to_its_log(service):
    issued = issue_certificate(date="2020-01-01", due="2021-01-01")
    text = make_log_text(issued, STARTED.date(), "")
    service.agent.overdue = tuple(list_overdue({"force": text}))
    run = start(service)
    assert run["calibration_overdue"] == list(service.agent.overdue)
    assert "overdue since 2021-01-01" in run["calibration_overdue"][0]
    write_complete_log(
        service.data / run["log"], run["id"], calibration={"force": text, "coil_drive": "none given"}
    )
    service.agent.finish("clean")
    ended = service.wait_for(f"/runs/{run['id']}", lambda found: found["state"] == "ended")
    assert ended["calibration_overdue"] == list(service.agent.overdue)


def test_a_log_from_elsewhere_brings_its_mark(service):
    text = make_log_text(issue_certificate(date="2020-01-01", due="2021-01-01"), STARTED.date(), "")
    write_complete_log(service.data / "one.mcap", "one", calibration={"force": text})
    write_complete_log(service.data / "two.mcap", "two", calibration={"force": "none given"})
    service.scan()
    assert len(service.get("/runs/one")["calibration_overdue"]) == 1
    assert service.get("/runs/two")["calibration_overdue"] == []


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
    assert (again["id"], again["state"], again["attempts"]) == (job["id"], "queued", 1)


def test_a_queued_job_is_cancelled_at_once_and_a_running_one_when_it_has_stopped(service):
    run = start(service)
    finish(service, run)
    waiting = get_last_job(service, run["id"])
    assert service.post(f"/jobs/{waiting['id']}/cancel")["state"] == "cancelled"
    running = service.post(f"/runs/{run['id']}/identify", {"budget_s": 5}, 201)
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


def test_a_job_that_never_ends_fails_after_its_last_attempt(service):
    run = start(service)
    finish(service, run)
    job = get_last_job(service, run["id"])
    for _ in range(MAX_ATTEMPTS):
        service.report("on_started", job["id"])
    assert service.get(f"/jobs/{job['id']}")["attempts"] == MAX_ATTEMPTS
    service.report("on_started", job["id"])
    found = service.get(f"/jobs/{job['id']}")
    assert (found["state"], found["attempts"]) == ("failed", MAX_ATTEMPTS)
    assert f"{MAX_ATTEMPTS} times" in found["error"]
    assert service.engine.cancelled == [(job["id"], True)]


def test_stop_is_sent_to_the_agent_unless_another_run_is_in_progress(service):
    run = start(service)
    assert service.post(f"/runs/{run['id']}/stop")["state"] == "stopping"
    assert service.agent.commands[-1].command == "stop"
    assert service.client.post("/api/v1/runs/another/stop").status_code == 409
    assert [command.command for command in service.agent.commands].count("stop") == 1


def test_an_unknown_run_cannot_be_stopped_and_an_ended_one_needs_no_stop(service):
    for verb in ("stop", "abort"):
        assert service.client.post(f"/api/v1/runs/NONSENSE/{verb}").status_code == 404
    run = start(service)
    finish(service, run)
    assert service.post(f"/runs/{run['id']}/abort")["state"] == "idle"
    assert not {"stop", "abort"} & {command.command for command in service.agent.commands}
    assert service.client.post(f"/api/v1/runs/{run['id']}/stop").status_code == 200


def test_a_run_and_the_bench_are_aborted_by_the_path_of_a_trip(service):
    run = start(service)
    assert service.post(f"/runs/{run['id']}/abort")["state"] == "tripped"
    assert service.client.post("/api/v1/runs/another/abort").status_code == 409
    assert service.post("/bench/abort")["trip"] == "aborted by a person"
    assert [one.command for one in service.agent.commands if one.command == "abort"] == ["abort", "abort"]


@pytest.mark.parametrize(
    ("outcome", "ending"),
    [("clean", "completed"), ("incomplete", "stopped"), ("incomplete", "aborted"), ("incomplete", "tripped")],
)
def test_a_run_has_an_ending_apart_from_its_outcome(service, outcome, ending):
    run = start(service)
    assert run["ending"] is None
    write_complete_log(service.data / run["log"], run["id"], outcome, ending=ending)
    service.agent.finish(outcome, "a reason" if ending != "completed" else "", ending)
    found = service.wait_for(f"/runs/{run['id']}", lambda found: found["outcome"])
    assert (found["outcome"], found["ending"]) == (outcome, ending)


def test_a_run_that_the_catalogue_cannot_record_is_started_nevertheless(service, monkeypatch, caplog):
    """A catalogue on a full disk: the rig moves, so the request has succeeded, and the catalogue catches up."""
    full = CatalogueUnavailableError("database or disk is full")
    add = Catalogue.add

    def fail(catalogue, row):
        raise full

    monkeypatch.setattr(Catalogue, "add", fail)
    run = start(service)
    assert (run["id"], run["state"], run["progress"]["elapsed_s"]) == ("run-1", "running", 0.0)
    for _ in range(20):
        service.agent.publish()
    assert service.get("/runs")["items"] == []
    monkeypatch.setattr(Catalogue, "add", add)
    service.agent.publish()
    assert service.wait_for("/runs", lambda found: found["items"])["items"][0]["id"] == "run-1"
    wait_until(lambda: "runs_recorded_again" in caplog.text)
    assert sum("runs_not_recorded" in record.message for record in caplog.records) == 1
    assert sum("runs_recorded_again" in record.message for record in caplog.records) == 1


def test_a_start_is_answered_while_a_scan_holds_the_records(service, monkeypatch):
    """The rig moves already, and a scan of many logs may take minutes."""
    monkeypatch.setattr(runs, "_RECORD_TIMEOUT", 0.05)
    lock = service.client.app.state.context.registry.lock
    service.client.portal.call(lock.acquire)
    try:
        assert (start(service)["id"], service.get("/runs")["items"]) == ("run-1", [])
    finally:
        service.client.portal.call(lock.release)
    assert service.wait_for("/runs", lambda found: found["items"])["items"][0]["id"] == "run-1"


def test_the_agents_reason_is_kept_although_the_log_has_no_end(service):
    """The disk was full, so the recorder could not write the end of the log."""
    run = start(service)
    log = write_truncated_log(service.data / run["log"], run["id"])
    service.agent.finish("incomplete", "no space left on device", "tripped")
    found = service.wait_for(f"/runs/{run['id']}", lambda found: found["state"] == "truncated")
    assert (found["reason"], found["ending"]) == ("no space left on device", "tripped")
    os.utime(log, (1.0, 1.0))
    service.client.portal.call(service.client.app.state.context.registry.scan)
    assert service.get(f"/runs/{run['id']}")["reason"] == "no space left on device"
    repaired = service.post(f"/runs/{run['id']}/salvage")
    assert (repaired["outcome"], repaired["ending"]) == ("truncated", "tripped")
    assert repaired["reason"] == "no space left on device"


def test_a_reason_that_the_agent_reports_after_a_scan_replaces_that_of_the_scan(service):
    run = start(service)
    write_truncated_log(service.data / run["log"], run["id"])
    catalogue = service.client.app.state.context.catalogue
    catalogue_log(catalogue, service.data / run["log"])
    assert "its recorder was killed" in service.get(f"/runs/{run['id']}")["reason"]
    service.agent.finish("incomplete", "no space left on device", "tripped")
    found = service.wait_for(f"/runs/{run['id']}", lambda found: found["ending"])
    assert found["reason"] == "no space left on device"


def pause(service, checkpoint="10mm_1Hz_0.2V"):
    """Start a run and end it at a checkpoint, as a pause does."""
    run = start(service)
    answer = service.post(f"/runs/{run['id']}/pause")
    assert answer["run"]["pause"] == f"at checkpoint {checkpoint}"
    path = service.data / run["log"]
    write_complete_log(path, run["id"], "incomplete", ending="stopped", method="quick", checkpoint=checkpoint)
    service.agent.finish("incomplete", f"paused at checkpoint {checkpoint}", "stopped")
    return service.wait_for(f"/runs/{run['id']}", lambda found: found["state"] == "ended")


def test_a_paused_run_is_resumed_after_its_checkpoint_by_a_linked_run(service):
    first = pause(service)
    assert (first["ending"], first["continues"]) == ("stopped", None)
    second = service.post(f"/runs/{first['id']}/resume", status=201)
    assert (second["continues"], second["specimen"]) == (first["id"], first["specimen"])
    command = [one for one in service.agent.commands if one.command == "run"][-1]
    assert (command.resume_after, command.continues) == ("10mm_1Hz_0.2V", first["id"])
    assert command.method["name"] == "quick"


def test_a_run_is_resumed_after_another_checkpoint_on_request(service):
    first = pause(service)
    service.post(f"/runs/{first['id']}/resume", {"after": "5mm_2.5Hz_0.3V"}, 201)
    assert service.agent.commands[-1].command in ("run", "status")
    command = [one for one in service.agent.commands if one.command == "run"][-1]
    assert command.resume_after == "5mm_2.5Hz_0.3V"


def test_what_cannot_be_paused_or_resumed_is_refused(service):
    run = start(service)
    assert service.client.post(f"/api/v1/runs/{run['id']}/resume").status_code == 409
    finish(service, run)
    for verb in ("pause", "resume"):
        assert service.client.post(f"/api/v1/runs/{run['id']}/{verb}").status_code == 409
        assert service.client.post(f"/api/v1/runs/NONSENSE/{verb}").status_code == 404


def test_the_checkpoints_of_methods_are_listed(service):
    methods = {method["name"]: method["checkpoints"] for method in service.get("/methods")["items"]}
    assert methods["quick"] == ["10mm_1Hz_0.2V", "5mm_2.5Hz_0.3V"]
    assert all(methods.values())


def test_a_changed_or_deleted_log_is_shown_and_not_identified_again(service):
    run = start(service)
    recorded = finish(service, run)["log_sha256"]
    assert service.post(f"/runs/{run['id']}/integrity")["integrity"] == "intact"
    path = service.data / run["log"]
    path.write_bytes(path.read_bytes() + b"x")
    found = service.post(f"/runs/{run['id']}/integrity")
    assert (found["integrity"], found["recorded_sha256"]) == ("changed", recorded)
    assert found["found_sha256"] not in (None, recorded)
    refused = service.client.post(f"/api/v1/runs/{run['id']}/identify", json={"budget_s": 5})
    assert (refused.status_code, refused.json()["type"]) == (409, "urn:mrbench:problem:log-damaged")
    path.unlink()
    service.client.portal.call(service.client.app.state.context.registry.scan)
    assert service.get(f"/runs/{run['id']}")["integrity"] == "missing"
    assert service.get(f"/runs/{run['id']}/integrity") == {
        **found, "integrity": "missing", "found_sha256": None,
        "checked": service.get(f"/runs/{run['id']}/integrity")["checked"],
    }  # fmt: skip
    assert service.get(f"/runs/{run['id']}")["log_sha256"] == recorded


def test_a_run_in_progress_has_no_hash_to_compare(service):
    run = start(service)
    assert service.client.post(f"/api/v1/runs/{run['id']}/integrity").status_code == 409
    assert service.get(f"/runs/{run['id']}/integrity")["recorded_sha256"] is None


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


def test_a_run_whose_service_was_killed_before_it_was_identified_is_identified(service):
    run = start(service)
    write_complete_log(service.data / run["log"], run["id"])
    context = service.client.app.state.context
    service.agent.forget()
    assert catalogue_log(context.catalogue, service.data / run["log"]).outcome == "clean"
    service.start()
    assert get_last_job(service, run["id"])["state"] == "queued"
    service.scan()
    assert len(service.get(f"/runs/{run['id']}")["jobs"]) == 1


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


@pytest.mark.parametrize("reported", [False, True], ids=["killed", "reported by the agent"])
def test_a_log_without_a_sample_is_not_offered_for_repair_again(service, reported):
    run = start(service)
    write_empty_log(service.data / run["log"], run["id"])
    if reported:
        service.agent.finish("incomplete", "no space left on device", "tripped")
    else:
        service.end()
        service.agent.forget()
        service.start()
        service.agent.publish()
    service.wait_for(f"/runs/{run['id']}", lambda found: found["state"] == "truncated")
    refused = service.client.post(f"/api/v1/runs/{run['id']}/salvage")
    assert refused.status_code == 409
    assert "before it wrote a sample" in refused.json()["detail"]
    found = service.get(f"/runs/{run['id']}")
    assert (found["state"], found["outcome"]) == ("ended", "incomplete")
    assert ("no space left" if reported else "before it wrote a sample") in found["reason"]
    assert service.client.post(f"/api/v1/runs/{run['id']}/salvage").status_code == 409


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


def test_a_run_whose_log_was_not_begun_counts_as_ended(service):
    run = start(service)
    (service.data / run["log"]).write_bytes(b"")
    os.utime(service.data / run["log"], ns=(1, 1))
    service.agent.forget()
    service.start()
    found = service.wait_for(f"/runs/{run['id']}", lambda found: found["state"] == "ended")
    assert found["outcome"] == "incomplete"
    assert "before it described the run in its log" in found["reason"]


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
    answer = service.client.post("/api/v1/bench/prepare", json={"step": "move"})
    assert answer.status_code == 422
    assert "move needs position_m" in answer.json()["detail"]
    assert service.agent.commands == []
    service.post("/bench/prepare", {"step": "move", "position_m": 0.0})
    service.post("/bench/prepare", {"step": "tare"})
    assert [(one.step, one.position_m) for one in service.agent.commands] == [("move", 0.0), ("tare", None)]


def test_every_run_of_a_long_page_shows_its_fit(service):
    """Each page read at most 200 jobs of all its runs together before."""
    catalogue = service.client.app.state.context.catalogue
    for number in range(101):
        started = STARTED + timedelta(minutes=number)
        values = {"method": "quick", "started": started, "state": "ended", "log": f"{number}.mcap"}
        catalogue.add(RunRow(id=f"old-{number}", **values))
        for k, state in enumerate(["done", "cancelled", "cancelled"]):
            created = started + timedelta(seconds=k)
            job = JobRow(id=f"{number}-{k}", run_id=f"old-{number}", kind="identify", key=f"{number}", settings={})
            job.state, job.created, job.summary = state, created, SUMMARY if state == "done" else None
            catalogue.add(job)
    items = service.get("/runs?limit=101")["items"]
    assert [run["rmse_n"] for run in items] == [2.5] * 101
    assert {len(run["jobs"]) for run in items} == {3}

"""Samples, segments, events, files, notes, tags and trash by the REST interface."""

import hashlib
import os

import numpy as np
import pytest

from bench.agent_protocol import AgentEvent
from bench.replay import ReplayResult
from bench.samples import decode_batches
from bench.service.routes.recordings.replay import describe_replay
from tests.support.logs import write_log
from tests.support.service_logs import write_complete_log, write_truncated_log

API = "/api/v1"


@pytest.fixture
def service(service):
    """Return a service with one recorded run of 3 s."""
    write_log(service.data / "one.mcap")
    service.scan()
    return service


def change_tags(service, tags, tag=None, **headers):
    given = {"If-Match": tag} if tag else {}
    body = {"author": "M. Curie", "tags": tags}
    return service.client.patch(f"{API}/runs/run-1", json=body, headers=given | headers)


def get_tag(service):
    return service.client.get(f"{API}/runs/run-1").headers["ETag"]


def test_samples_have_names_units_and_the_chosen_time(service):
    found = service.get("/runs/run-1/samples?channel=force&channel=displacement&from=0.5&to=1&points=0")
    assert found["channels"] == [{"name": "force", "unit": "N"}, {"name": "displacement", "unit": "m"}]
    assert (found["time"][0], found["time"][-1]) == (pytest.approx(0.5), pytest.approx(1.0))
    assert (found["samples"], found["decimated"], len(found["values"]["force"])) == (251, False, 251)


def test_decimation_keeps_lowest_and_highest(service):
    whole = service.get("/runs/run-1/samples?channel=force&points=0")["values"]["force"]
    found = service.get("/runs/run-1/samples?channel=force&points=10")
    assert found["decimated"]
    assert len(found["time"]) <= 22
    assert (min(found["values"]["force"]), max(found["values"]["force"])) == (min(whole), max(whole))


def test_samples_are_returned_as_binary_batches(service):
    answer = service.client.get(f"{API}/runs/run-1/samples?channel=force&format=float32&points=0")
    assert (
        answer.headers["X-Mrbench-Channels"] == '[{"name": "time", "unit": "s"}, {"name": "force", "unit": "N"}]'
    )
    time, (force,) = decode_batches(answer.content, 2)
    expected = service.get("/runs/run-1/samples?channel=force&points=0")
    np.testing.assert_allclose(time, expected["time"], atol=1e-6)
    np.testing.assert_allclose(force, expected["values"]["force"], rtol=1e-6)


@pytest.mark.parametrize(
    ("path", "status", "message"),
    [
        ("/runs/run-1/samples?channel=power", 422, "power is not recorded in this run; its channels are disp"),
        ("/runs/run-1/samples?points=-1", 422, "points"),
        ("/runs/run-1/samples?from=nan", 422, "from"),
        ("/runs/run-9/samples", 404, "run-9"),
        ("/runs/run-9/events", 404, "run-9"),
        ("/runs/run-9/notes", 404, "run-9"),
        ("/runs/run-9/files", 404, "run-9"),
    ],
)  # fmt: skip
def test_a_wrong_request_is_refused_with_its_reason(service, path, status, message):
    answer = service.client.get(API + path)
    assert answer.status_code == status
    assert message in answer.json()["detail"]


def test_a_truncated_log_has_no_samples_yet(service):
    log = write_truncated_log(service.data / "two.mcap", run="run-2")
    os.utime(log, (1.0, 1.0))
    service.scan()
    answer = service.client.get(f"{API}/runs/run-2/samples")
    assert answer.status_code == 409
    assert "truncated" in answer.json()["detail"]


def test_segments_have_motion_drive_and_time(service):
    (segment,) = service.get("/runs/run-1/segments")["items"]
    assert (segment["name"], segment["amplitude_m"], segment["drive_value"]) == ("10mm_1Hz_0.2V", 0.01, 0.2)
    assert (segment["start_s"], segment["stop_s"]) == (pytest.approx(0.2), pytest.approx(1.998))


def test_events_of_a_log_stay_after_a_restart(service):
    (event,) = service.get("/runs/run-1/events")["items"]
    assert (event["kind"], event["text"], event["run"]) == ("state", "run finished", "run-1")
    service.start()
    assert service.get("/runs/run-1/events")["items"] == [event]


def test_events_of_the_bench_are_stored_when_they_happen(service):
    service.agent.publish(AgentEvent(time_ns=5, kind="state", text="the agent is ready"))
    found = service.wait_for("/events?limit=1", lambda page: page["items"][0]["text"] == "the agent is ready")
    assert found["items"][0]["run"] is None
    older = service.get(f"/events?before={found['next']}")["items"]
    assert [event["text"] for event in older] == ["run finished"]


def test_an_event_during_a_run_belongs_to_it(service):
    run = service.post("/runs", {"method": "quick", "specimen": "damper 7"}, 201)["id"]
    service.agent.publish(AgentEvent(time_ns=5, kind="alarm", text="force 900 N"))
    found = service.wait_for("/events?limit=1", lambda page: page["items"][0]["kind"] == "alarm")
    assert found["items"][0]["run"] == run


def test_files_are_listed_with_size_hash_and_address(service):
    (job,) = service.wait_for("/runs/run-1", lambda run: run["jobs"])["jobs"]
    service.complete(job, {"rmse_n": 1.0, "noise_floor_n": 1.0}, {"fit.json": "{}", "report.html": "<p>"})
    log, fit, *offers = service.get("/runs/run-1/files")["items"]
    assert (log["kind"], log["size"]) == ("log", (service.data / "one.mcap").stat().st_size)
    assert (fit["kind"], fit["path"]) == ("fit", f"{API}/fits/{job['id']}")
    assert log["sha256"] == hashlib.sha256((service.data / "one.mcap").read_bytes()).hexdigest()
    assert fit["sha256"] == hashlib.sha256(b"{}").hexdigest()
    assert {file["sha256"] for file in offers} == {None}
    assert [file["kind"] for file in offers] == ["export"] * 3 + ["report"] * 3
    assert all(service.client.get(file["path"]).status_code == 200 for file in (log, fit))


def test_size_losses_and_hash_stand_in_the_view(service):
    run = service.get("/runs/run-1")
    assert run["log_bytes"] == (service.data / "one.mcap").stat().st_size
    assert (run["lost"], run["alarms"], run["tags"], run["trashed"]) == ({}, [], [], None)
    assert len(run["log_sha256"]) == 64


def test_notes_are_added_in_order_and_found(service):
    first = service.post("/runs/run-1/notes", {"author": " M. Curie ", "text": "Seal leaks."}, 201)
    service.post("/runs/run-1/notes", {"author": "P. Curie", "text": "Correction: the fitting leaks."}, 201)
    notes = service.get("/runs/run-1/notes")["items"]
    assert [note["text"] for note in notes] == ["Seal leaks.", "Correction: the fitting leaks."]
    assert (first["author"], first["kind"], first["at"][-1]) == ("M. Curie", "note", "Z")
    page = service.get("/runs/run-1/notes?limit=1")
    assert service.get(f"/runs/run-1/notes?after={page['next']}")["items"] == notes[1:]
    assert [run["id"] for run in service.get("/runs?text=FITTING")["items"]] == ["run-1"]
    assert service.get("/runs?text=bearing")["items"] == []


@pytest.mark.parametrize("body", [{"author": "", "text": "a"}, {"author": "a", "text": ""}, {"text": "a"}])
def test_a_note_without_author_or_text_is_refused(service, body):
    assert service.client.post(f"{API}/runs/run-1/notes", json=body).status_code == 422


def test_no_verb_changes_a_note(service):
    note = service.post("/runs/run-1/notes", {"author": "M. Curie", "text": "Seal leaks."}, 201)
    for verb in ("PATCH", "PUT", "DELETE"):
        answer = service.client.request(verb, f"{API}/runs/run-1/notes/{note['id']}")
        assert answer.status_code in (404, 405)


def test_tags_are_changed_noted_and_found(service):
    before = (service.data / "one.mcap").read_bytes()
    answer = change_tags(service, ["warm", "batch 3", "warm"], get_tag(service))
    assert (answer.status_code, answer.json()["tags"]) == (200, ["batch 3", "warm"])
    assert answer.headers["ETag"] == get_tag(service)
    assert [run["id"] for run in service.get("/runs?tag=batch 3")["items"]] == ["run-1"]
    assert service.get("/runs?tag=batch")["items"] == []
    (note,) = service.get("/runs/run-1/notes")["items"]
    assert (note["kind"], note["text"]) == ("tags", "Tags: batch 3, warm (before: none)")
    assert (service.data / "one.mcap").read_bytes() == before


def test_a_change_of_an_outdated_run_is_refused(service):
    seen = get_tag(service)
    assert change_tags(service, ["warm"], seen).status_code == 200
    answer = change_tags(service, ["cold"], seen)
    assert (answer.status_code, answer.json()["type"]) == (412, "urn:mrbench:problem:changed-meanwhile")
    assert service.get("/runs/run-1")["tags"] == ["warm"]
    assert change_tags(service, ["cold"]).status_code == 428
    assert change_tags(service, ["cold"], "*").status_code == 200


@pytest.mark.parametrize("tag", ["", 'a"b', "a\nb", "x" * 61])
def test_a_tag_that_cannot_be_searched_is_refused(service, tag):
    assert change_tags(service, [tag], "*").status_code == 422


def test_a_run_moves_to_the_trash_and_its_jobs_are_cancelled(service):
    (job,) = service.wait_for("/runs/run-1", lambda run: run["jobs"])["jobs"]
    answer = service.client.delete(f"{API}/runs/run-1")
    assert (answer.status_code, answer.json()["trashed"] is not None) == (200, True)
    assert service.get(f"/jobs/{job['id']}")["state"] == "cancelled"
    assert service.get("/runs")["items"] == []
    assert [run["id"] for run in service.get("/runs?trash=true")["items"]] == ["run-1"]
    assert service.client.delete(f"{API}/runs/run-1").status_code == 409
    assert service.client.post(f"{API}/runs/run-1/identify").status_code == 409
    assert service.get("/runs/run-1/samples")["samples"] == 1500
    assert service.post("/runs/run-1/restore")["trashed"] is None
    assert [run["id"] for run in service.get("/runs")["items"]] == ["run-1"]
    assert service.client.post(f"{API}/runs/run-1/restore").status_code == 409


def test_a_run_in_progress_is_not_moved_to_the_trash(service):
    write_complete_log(service.data / "two.mcap", run="run-2")
    service.agent.status = service.agent.status.model_copy(update={"finished": ()})
    service.client.app.state.context.catalogue.update_run("run-1", state="running")
    answer = service.client.delete(f"{API}/runs/run-1")
    assert (answer.status_code, answer.json()["title"]) == (409, "The run goes on")


def test_the_raw_frames_of_a_run_are_decoded_again_and_the_answer_says_so(service):
    found = service.post("/runs/run-1/replay")
    assert (found["equal"], found["instruments"]) == (True, [])
    assert found["text"] == "The log has no raw frames: it was imported, or recorded without wires."


@pytest.mark.parametrize(
    ("differences", "words"), [(0, "all 9 readings are equal"), (2, "differ from the readings")]
)
def test_the_answer_on_raw_frames_names_differences(differences, words):
    text = describe_replay(
        [ReplayResult("lvdt", 5, 9, differences, "lvdt 3 was recorded but is not in the frames")]
    )
    assert words in text
    assert ("was recorded but" in text) == bool(differences)

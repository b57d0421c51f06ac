"""Repeated requests with one idempotency key: one effect, one answer."""

import threading
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta

import pytest

from bench.agent_protocol import RunCommand
from bench.catalogue import CatalogueUnavailableError, IdempotencyKeys
from tests.support.service_logs import write_complete_log

BODY = {"method": "quick", "specimen": "damper 7"}


def post(service, path, body, key, status=201):
    answer = service.client.post(f"/api/v1{path}", json=body, headers={"Idempotency-Key": key})
    assert answer.status_code == status, answer.text
    return answer


def count_starts(service):
    return sum(isinstance(command, RunCommand) for command in service.agent.commands)


def lose_answers(monkeypatch):
    """Let no answer be stored, as after a kill between start and answer."""
    monkeypatch.setattr(IdempotencyKeys, "store", lambda *given: None)


def test_a_repeated_start_returns_the_same_answer_and_starts_nothing(service):
    first = post(service, "/runs", BODY, "key-1")
    service.agent.finish()
    second = post(service, "/runs", BODY, "key-1")
    assert second.json() == first.json()
    assert second.headers["Location"] == first.headers["Location"]
    assert second.headers["Idempotency-Replayed"] == "true"
    assert "Idempotency-Replayed" not in first.headers
    assert count_starts(service) == 1


def test_another_body_or_path_with_the_same_key_is_refused_with_a_sentence(service):
    post(service, "/runs", BODY, "key-1")
    other = post(service, "/runs", {**BODY, "specimen": "damper 8"}, "key-1", 422).json()
    assert other["type"] == "urn:mrbench:problem:idempotency-key-refused"
    assert "another body" in other["detail"]
    elsewhere = post(service, "/bench/prepare", {"step": "tare"}, "key-1", 422).json()
    assert "belongs to POST /api/v1/runs" in elsewhere["detail"]
    assert count_starts(service) == 1


@pytest.mark.parametrize("key", ["", "two words", "x" * 256])
def test_an_unusable_key_is_refused(service, key):
    answer = post(service, "/runs", BODY, key, 422).json()
    assert "1 to 255 visible ASCII characters" in answer["detail"]
    assert count_starts(service) == 0


def test_a_refused_request_can_be_repeated_with_its_key(service):
    service.agent.refuses = "the bench is not idle"
    post(service, "/runs", BODY, "key-1", 409)
    service.agent.refuses = ""
    assert post(service, "/runs", BODY, "key-1").json()["state"] == "running"


def test_simultaneous_requests_with_one_key_start_one_run(service):
    barrier = threading.Barrier(4)

    def start():
        barrier.wait()
        return post(service, "/runs", BODY, "key-1").json()["id"]

    with ThreadPoolExecutor(4) as pool:
        ids = {future.result() for future in [pool.submit(start) for _ in range(4)]}
    assert len(ids) == 1
    assert count_starts(service) == 1


def test_after_a_kill_between_start_and_answer_the_run_is_found_again(service, monkeypatch):
    with monkeypatch.context() as patch:
        lose_answers(patch)
        run = post(service, "/runs", BODY, "key-1").json()
    service.start()  # the service comes back; the agent has gone on
    again = post(service, "/runs", BODY, "key-1").json()
    assert again["id"] == run["id"]
    assert count_starts(service) == 1
    refused = post(service, "/runs", {**BODY, "operator": "another"}, "key-1", 422).json()
    assert "another body" in refused["detail"]


def test_a_run_that_only_the_agent_knows_is_found_again(service, monkeypatch):
    with monkeypatch.context() as patch:
        lose_answers(patch)
        run = post(service, "/runs", BODY, "key-1").json()
    monkeypatch.setattr(type(service.client.app.state.context.catalogue), "find_run_by_log", lambda *given: None)
    assert post(service, "/runs", BODY, "key-1").json()["id"] == run["id"]
    assert count_starts(service) == 1


def test_a_log_that_is_not_listed_yet_starts_no_second_run(service, monkeypatch):
    with monkeypatch.context() as patch:
        lose_answers(patch)
        run = post(service, "/runs", BODY, "key-1").json()
    write_complete_log(service.data / run["log"], run["id"])
    service.agent.forget()
    monkeypatch.setattr(type(service.client.app.state.context.catalogue), "find_run_by_log", lambda *given: None)
    answer = post(service, "/runs", BODY, "key-1", 409).json()
    assert answer["type"] == "urn:mrbench:problem:run-not-listed-yet"
    assert count_starts(service) == 1


def test_an_answer_that_cannot_be_stored_is_given_all_the_same(service, monkeypatch):
    def fail(*given):
        raise CatalogueUnavailableError("database or disk is full")

    monkeypatch.setattr(IdempotencyKeys, "store", fail)
    run = post(service, "/runs", BODY, "key-1").json()
    assert post(service, "/runs", BODY, "key-1").json()["id"] == run["id"]
    assert count_starts(service) == 1


def test_a_stop_takes_no_key_and_always_acts(service):
    post(service, "/runs", BODY, "key-1")
    for _ in range(2):
        post(service, "/bench/stop", None, "key-2", 200)
    assert [command.command for command in service.agent.commands].count("stop") == 2


def test_the_description_names_the_header_of_what_starts_something(service):
    paths = service.get("/openapi.json")["paths"]
    names = {
        path for path, verbs in paths.items() for one in verbs.get("post", {}).get("parameters", [])
        if one["name"] == "idempotency-key"
    }  # fmt: skip
    assert {"/api/v1/runs", "/api/v1/runs/{run_id}/identify", "/api/v1/bench/prepare"} <= names
    assert "/api/v1/bench/stop" not in names


def test_keys_expire_after_a_day(service):
    keys = service.client.app.state.context.catalogue.idempotency_keys
    long_ago = datetime.now(UTC) - timedelta(days=2)
    keys.claim("key-1", "POST /api/v1/runs?", "0" * 64, long_ago)
    keys.store("key-1", 201, {}, "{}")
    assert post(service, "/runs", BODY, "key-1").json()["state"] == "running"


def test_an_upload_is_recognised_although_its_boundary_differs(service):
    rows = "".join(f"{k / 1000:.3f},{k * 1e-6:.6f},{k:.1f},0.0\n" for k in range(300))
    content = "time_s,displacement_m,force_n,voltage_v\n" + rows

    def send(text):
        files = {"file": ("a.csv", text.encode(), "text/csv")}
        return service.client.post("/api/v1/logs", files=files, headers={"Idempotency-Key": "key-1"})

    first, second = send(content), send(content)
    assert (first.status_code, second.status_code) == (201, 201), first.text
    assert second.json() == first.json()
    assert len(list(service.data.glob("*.mcap"))) == 1
    assert send(content + "0.300,0.0003,1.0,0.0\n").status_code == 422

"""Requests in the audit trail: who, from where, what, old and new value, outcome; what happens without a disk."""

import errno
import os
import time

import pytest

from bench.agent_protocol import StopCommand, get_sender
from bench.audit import verify_chain
from bench.service.audit.trail import _REFUSALS_PER_MINUTE
from tests.support.audit_trails import find_last_request as find_last
from tests.support.audit_trails import list_all, list_requests, wait_for

API = "/api/v1"


def test_a_request_is_on_the_disk_when_it_is_answered(service, client):
    body = {"serial": "d7", "description": "a damper"}
    assert client.post(f"{API}/specimens", json=body).status_code == 201
    entry = find_last(service)
    assert (entry.actor, entry.origin, entry.action) == ("bench", "testclient", "POST /specimens")
    assert (entry.old, entry.new, entry.outcome) == (None, body, "201")
    assert entry.request
    assert not verify_chain(service.data / "audit.jsonl").fault


def test_the_actor_is_that_of_the_access_check(service, client):
    app = client.app

    async def sign_in(scope, receive, send):
        scope.setdefault("state", {})["actor"] = "user:mcurie"
        await checked(scope, receive, send)

    middleware = app.middleware_stack
    while type(middleware).__name__ != "AccessCheckMiddleware":
        middleware = getattr(middleware, "_app", None) or middleware.app
    checked, middleware._app = middleware._app, sign_in
    senders = []
    service.agent.send = lambda command, timeout=5.0, send=service.agent.send: (
        senders.append(get_sender()) if isinstance(command, StopCommand) else None,
        send(command, timeout),
    )[1]
    client.post(f"{API}/bench/stop")
    entry = wait_for(lambda: list_requests(service))[-1]
    assert entry.actor == "user:mcurie"
    assert [(one.actor, one.origin, one.request) for one in senders] == [
        ("user:mcurie", "testclient", entry.request)
    ]


def test_reads_and_dry_runs_are_not_recorded(service, client):
    for path in ("health", "bench", "runs", "audit", "audit/head", "audit/export"):
        assert client.get(f"{API}/{path}").status_code == 200
    assert client.post(f"{API}/methods/dry-run", json={"method": "quick", "identifiability": False}).is_success
    assert client.post(f"{API}/campaigns/plan", json={"campaign": {}}).status_code == 422
    assert list_requests(service) == []


@pytest.mark.parametrize(
    ("method", "path", "action", "target", "outcome"),
    [
        ("POST", "runs/run-9/salvage", "POST /runs/{run_id}/salvage", "run-9", "404 there is no run run-9"),
        ("POST", "specimens/a/b/trend", "POST /specimens/{serial}/trend", "a/b", "404 there is no specimen a/b"),
        ("PUT", "runs", "PUT /runs", "", "405 "),
        ("POST", "nothing/here", "POST /nothing/here", "", "404 "),
        ("POST", "jobs/job-1/cancel", "POST /jobs/{job_id}/cancel", "job-1", "404 there is no job job-1"),
    ],
)
def test_refused_requests_are_recorded_with_the_reason(service, client, method, path, action, target, outcome):
    client.request(method, f"{API}/{path}")
    entry = find_last(service)
    assert (entry.action, entry.target) == (action, target)
    assert entry.outcome.startswith(outcome)


def test_a_request_without_sign_in_is_recorded_as_of_nobody_known(service, client):
    del client.headers["Authorization"]
    client.post(f"{API}/runs/run-1/stop", json={"secret": 1})
    client.post(f"{API}/runs", json={"method": "quick"})
    first, second = wait_for(lambda: len(found := list_requests(service)) == 2 and found)
    assert (first.actor, first.action, first.target) == ("unknown", "POST /runs/{run_id}/stop", "run-1")
    assert (second.action, second.new) == ("POST /runs", None)
    assert second.outcome.startswith("401 ")


def test_many_requests_without_sign_in_are_counted_instead_of_filling_the_disk(service, client):
    del client.headers["Authorization"]
    for _ in range(_REFUSALS_PER_MINUTE + 25):
        client.post(f"{API}/runs")
    assert len(list_requests(service)) == _REFUSALS_PER_MINUTE
    trail = client.app.state.context.audit
    trail._clock = lambda: time.monotonic() + 61
    client.post(f"{API}/runs")
    counted = list_all(trail.path)[-2]
    assert (counted.action, counted.new) == ("further requests refused", 25)


def test_secrets_are_not_recorded(service, client):
    secret, path = "correct horse battery staple", f"{API}/bench/prepare"
    client.post(path, json={"step": "home", "password": secret, "token": secret, "code": secret})
    client.post(path, content=f'{{"password": "{secret}"', headers={"Content-Type": "application/json"})
    whole, broken = list_requests(service)
    assert whole.new == {"step": "home", "password": "…", "token": "…", "code": "…"}
    assert broken.new["invalid"] is True
    content = (service.data / "audit.jsonl").read_bytes()
    assert secret.encode() not in content
    assert service.token.encode() not in content


def test_an_upload_and_a_large_body_are_recorded_by_their_size(service, client, tmp_path):
    client.post(f"{API}/logs", files={"file": ("a.txt", b"x" * 100_000)})
    entry = find_last(service)
    assert (entry.action, entry.new["content_type"]) == ("POST /logs", "multipart/form-data")
    assert entry.new["bytes"] > 100_000
    client.post(f"{API}/runs", json={"method": {"name": "m", "rows": list(range(100_000))}})
    entry = find_last(service)
    assert set(entry.new) == {"bytes", "sha256"}


def test_the_id_of_what_was_created_is_the_target_and_a_repeated_answer_is_marked(service, client):
    headers = {"Idempotency-Key": "k1"}
    for _ in range(2):
        client.post(f"{API}/runs", json={"method": "quick", "specimen": "d1"}, headers=headers)
    first, second = list_requests(service)
    assert (first.target, first.outcome) == ("run-1", "201")
    assert second.outcome == "201 answer repeated, nothing was done"


def test_a_defect_is_recorded(service, client):
    service.agent.defect = RuntimeError("broken")
    assert client.post(f"{API}/bench/reset").status_code == 500
    entry = wait_for(lambda: list_requests(service))[-1]
    assert (entry.action, entry.outcome) == ("POST /bench/reset", "500")


@pytest.fixture
def full_disk(client, monkeypatch):
    def refuse(file):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", refuse)
    client.post(f"{API}/bench/stop")
    wait_for(lambda: client.app.state.context.audit.find_obstacle())
    yield
    monkeypatch.undo()


def test_without_a_disk_stop_and_abort_work_and_all_else_is_refused(service, client, full_disk):
    for path in ("bench/stop", "bench/abort"):
        assert client.post(f"{API}/{path}").status_code == 200
    assert [one.command for one in service.agent.commands] == ["stop", "stop", "abort"]
    for path in ("bench/reset", "runs", "specimens"):
        answer = client.post(f"{API}/{path}", json={})
        assert (answer.status_code, answer.json()["type"]) == (503, "urn:mrbench:problem:audit-unwritable")
        assert "No space left on device" in answer.json()["detail"]
        assert "nothing was done, because it could not be recorded" in answer.json()["detail"]
    assert client.get(f"{API}/runs").status_code == 200
    assert "No space left on device" in service.get("/health")["audit"]
    assert len(service.agent.commands) == 3


def test_what_was_stopped_without_a_disk_is_recorded_once_there_is_one(service, client, full_disk, monkeypatch):
    client.post(f"{API}/bench/abort")
    assert list_requests(service) == []
    monkeypatch.undo()
    entries = wait_for(lambda: len(found := list_requests(service)) == 2 and found)
    assert [one.action for one in entries] == ["POST /bench/stop", "POST /bench/abort"]
    wait_for(lambda: service.get("/health")["audit"] == "ok")


def test_start_and_end_of_the_service_are_recorded_and_one_chain_goes_on(service):
    service.end()
    service.start()
    service.get("/health")
    path = service.data / "audit.jsonl"
    actions = wait_for(lambda: len(found := [one.action for one in list_all(path)]) == 4 and found)
    assert actions == ["chain begun", "service start", "service end", "service start"]
    assert not verify_chain(path).fault


def test_an_altered_trail_is_shown_by_the_health_of_the_next_service(service):
    service.client.post(f"{API}/bench/reset")
    service.end()
    path = service.data / "audit.jsonl"
    path.write_bytes(path.read_bytes().replace(b"/bench/reset", b"/bench/other"))
    service.start()
    health = service.wait_for("/health", lambda health: health["audit"] != "ok")
    assert "the audit trail was altered: line 3: its content does not have its hash" in health["audit"]

"""Answers that are kept while nothing has changed that they show."""

import sqlite3

import pytest

from bench.catalogue.job_queue import JobQueue
from bench.service.application import CATALOGUE_PATHS, STATUS_PATHS
from bench.service.context import ServiceContext
from tests.support.service_logs import write_complete_log


@pytest.fixture
def counted(service, monkeypatch):
    """Number of times that the views of a list were made."""
    made, original = [], ServiceContext.make_run_views

    def count(context, *rows):
        made.append(len(rows))
        return original(context, *rows)

    monkeypatch.setattr(ServiceContext, "make_run_views", count)
    service.agent.publish()
    service.wait_for("/bench", lambda status: status["state"] == "idle")
    return made


def add_run(service, name="run"):
    write_complete_log(service.data / f"{name}.mcap", name)
    service.scan()


def test_a_repeated_request_is_answered_without_the_catalogue(service, counted):
    add_run(service)
    counted.clear()
    first, second = (service.client.get("/api/v1/runs") for _ in range(2))
    assert first.content == second.content
    assert second.headers.raw == first.headers.raw
    assert counted == [1]


def test_a_change_of_the_catalogue_is_shown_at_once(service, counted):
    assert service.get("/runs")["items"] == []
    add_run(service)
    (run,) = service.get("/runs")["items"]
    address = f"/api/v1/runs/{run['id']}"
    tag = service.client.get(address).headers["ETag"]
    answer = service.client.patch(address, json={"author": "A", "tags": ["warm"]}, headers={"If-Match": tag})
    assert answer.status_code == 200, answer.text
    assert service.get("/runs")["items"][0]["tags"] == ["warm"]


def test_a_change_by_another_program_is_shown_at_once(service, counted):
    add_run(service)
    service.get("/runs")
    with sqlite3.connect(service.data / "catalogue.db") as other:
        other.execute("UPDATE runs SET operator = 'A. Meyer'")
    other.close()
    assert service.get("/runs")["items"][0]["operator"] == "A. Meyer"


def test_a_change_of_the_status_is_shown_at_once(service, counted):
    assert service.get("/bench")["state"] == "idle"
    service.post("/bench/abort")
    assert service.get("/bench")["state"] == "tripped"


def test_a_new_status_keeps_the_answers_that_do_not_show_it(service, counted, monkeypatch):
    made, original = [], JobQueue.list_jobs
    monkeypatch.setattr(JobQueue, "list_jobs", lambda *given: made.append(1) or original(*given))
    service.get("/jobs")
    service.get("/runs")
    before = len(made), len(counted)
    service.post("/bench/abort")
    service.wait_for("/bench", lambda status: status["state"] == "tripped")
    service.get("/jobs")
    service.get("/runs")
    assert (len(made), len(counted)) == (before[0], before[1] + 1)


def test_an_old_status_is_not_repeated(service, counted, monkeypatch):
    assert service.get("/bench")["state"] == "idle"
    service.agent.reachable = False
    monkeypatch.setattr("bench.service.agent_monitor.STATUS_LIFETIME", 0.0)
    for _ in range(2):
        assert service.client.get("/api/v1/bench").status_code == 503


def test_a_query_has_an_answer_of_its_own(service, counted):
    add_run(service)
    assert len(service.get("/runs?specimen=nobody")["items"]) == 0
    assert len(service.get("/runs")["items"]) == 1
    assert len(service.get("/runs?specimen=nobody")["items"]) == 0


def test_a_refusal_is_not_kept_as_an_answer(service, counted):
    for _ in range(2):
        assert service.client.get("/api/v1/runs?limit=0").status_code == 422


def test_a_kept_answer_needs_the_token(service, counted):
    service.get("/runs")
    del service.client.headers["Authorization"]
    assert service.client.get("/api/v1/runs").status_code == 401


def test_head_is_answered_without_a_body(service, counted):
    whole = service.client.get("/api/v1/runs")
    head = service.client.head("/api/v1/runs")
    assert (head.content, head.headers["content-length"]) == (b"", whole.headers["content-length"])


def test_the_metrics_count_kept_answers_by_their_operation(service, counted):
    for _ in range(3):
        service.get("/runs")
    text = service.client.get("/api/v1/metrics").text
    (line,) = [one for one in text.splitlines() if "duration_seconds_count{" in one and '"list_runs"' in one]
    assert float(line.split()[-1]) == 3


def test_the_paths_are_routes_of_the_service(service):
    paths = service.client.app.openapi()["paths"]
    assert all("get" in paths[path] for path in CATALOGUE_PATHS | STATUS_PATHS)

"""Workers as the scheduler sees them: ages of their heartbeats, and those that it removes."""

from types import SimpleNamespace

import pytest

from bench.jobs import scheduler
from bench.jobs.scheduler import (
    HEARTBEAT_LIMIT,
    WORKER_TTL,
    SilentWorkerReport,
    describe_workers,
    measure_heartbeat_ages,
)

FIRST, SECOND = "tls://127.0.0.1:4001", "tls://10.0.0.2:4002"


def make_scheduler(**last_seen):
    workers = {
        name: SimpleNamespace(address=name, last_seen=at, pid=number)
        for number, (name, at) in enumerate(last_seen.items(), 100)
    }
    return SimpleNamespace(workers=workers)


def test_the_age_of_a_heartbeat_is_measured_by_the_clock_of_the_scheduler(monkeypatch):
    monkeypatch.setattr(scheduler, "time", lambda: 1_012.5)
    assert measure_heartbeat_ages(make_scheduler(a=1_000.0, b=1_012.0)) == {"a": 12.5, "b": 0.5}


@pytest.mark.parametrize(
    ("ages", "words"),
    [
        ({}, "no worker; start one: mrbench worker"),
        ({FIRST: 0.0}, "ok"),
        ({FIRST: HEARTBEAT_LIMIT, SECOND: 0.5}, "ok"),
        ({FIRST: 12.3}, "no answer from the worker for 12 s, such as from a suspended process; "),
        ({FIRST: 0.5, SECOND: 9.0}, f"no answer from 1 of 2 workers ({SECOND}) for 9 s"),
        ({FIRST: 8.0, SECOND: 9.0}, f"no answer from 2 of 2 workers ({FIRST}, {SECOND}) for 9 s"),
    ],
)
def test_a_worker_whose_last_heartbeat_is_old_does_not_count_as_ready(ages, words):
    assert describe_workers(ages).startswith(words)
    assert (describe_workers(ages) == "ok") is (words == "ok")


def test_a_silent_worker_is_named_before_its_job_is_given_to_another_one():
    assert HEARTBEAT_LIMIT < WORKER_TTL
    assert "is given to another worker within 60 s" in describe_workers({FIRST: 12.0})


def test_only_a_worker_that_was_removed_as_silent_is_reported():
    found = []
    report, workers = SilentWorkerReport(found.append), make_scheduler(a=0.0, b=0.0)
    for name in ("a", "b"):
        report.add_worker(workers, name)
    report.remove_worker(workers, "a", stimulus_id="handle-worker-cleanup-1")
    assert found == []
    report.remove_worker(workers, "b", stimulus_id="check-worker-ttl-1")
    report.remove_worker(workers, "b", stimulus_id="check-worker-ttl-2")
    assert found == [101]

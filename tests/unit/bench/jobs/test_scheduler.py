"""Workers as the scheduler sees them: their states, and those that it removes."""

import os
import signal
import subprocess
import sys
from types import SimpleNamespace

import pytest

from bench.jobs import scheduler
from bench.jobs.scheduler import (
    HEARTBEAT_LIMIT,
    WORKER_TTL,
    SilentWorkerReport,
    describe_workers,
    measure_worker_states,
)

FIRST, SECOND = "tls://127.0.0.1:4001", "tls://10.0.0.2:4002"


def make_scheduler(**last_seen):
    workers = {
        name: SimpleNamespace(address=name, last_seen=at, pid=number)
        for number, (name, at) in enumerate(last_seen.items(), 100)
    }
    return SimpleNamespace(workers=workers)


def make_state(age, suspended_pid=0):
    return {"age": age, "suspended_pid": suspended_pid}


def test_the_age_of_a_heartbeat_is_measured_by_the_clock_of_the_scheduler(monkeypatch):
    monkeypatch.setattr(scheduler, "time", lambda: 1_012.5)
    found = measure_worker_states(make_scheduler(a=1_000.0, b=1_012.0))
    assert found == {"a": make_state(12.5), "b": make_state(0.5)}


@pytest.mark.parametrize(
    ("address", "is_seen"), [(FIRST, True), ("tls://[::1]:4001", True), (SECOND, False), ("inproc://one", False)]
)
def test_a_stopped_process_of_this_machine_is_found(address, is_seen):
    with subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"]) as process:
        workers = {address: SimpleNamespace(address=address, last_seen=0.0, pid=process.pid)}
        assert measure_worker_states(SimpleNamespace(workers=workers))[address]["suspended_pid"] == 0
        process.send_signal(signal.SIGSTOP)
        os.waitpid(process.pid, os.WUNTRACED)
        found = measure_worker_states(SimpleNamespace(workers=workers))[address]["suspended_pid"]
        process.kill()
    assert found == (process.pid if is_seen else 0)
    assert measure_worker_states(SimpleNamespace(workers=workers))[address]["suspended_pid"] == 0


@pytest.mark.parametrize(
    ("states", "words"),
    [
        ({}, "no worker; start one: mrbench worker"),
        ({FIRST: make_state(0.0)}, "ok"),
        ({FIRST: make_state(HEARTBEAT_LIMIT), SECOND: make_state(0.5)}, "ok"),
        ({FIRST: make_state(12.3)}, "no answer from the worker for 12 s; "),
        ({FIRST: make_state(0.5), SECOND: make_state(9.0)}, f"no answer from 1 of 2 workers ({SECOND}) for 9 s"),
        (
            {FIRST: make_state(8.0), SECOND: make_state(9.0)},
            f"no answer from 2 of 2 workers ({FIRST}, {SECOND}) for 9 s",
        ),
        (
            {FIRST: make_state(0.1, 77)},
            "the worker is suspended; continue with: kill -CONT 77; else its job",
        ),
        (
            {FIRST: make_state(0.1, 77), SECOND: make_state(9.0)},
            f"1 of 2 workers ({FIRST}) is suspended; continue with: kill -CONT 77",
        ),
    ],
)
def test_a_suspended_worker_or_one_with_an_old_heartbeat_does_not_count_as_ready(states, words):
    assert describe_workers(states).startswith(words)
    assert (describe_workers(states) == "ok") is (words == "ok")


def test_a_silent_worker_is_named_before_its_job_is_given_to_another_one():
    assert HEARTBEAT_LIMIT < WORKER_TTL
    assert "is given to another worker within 60 s" in describe_workers({FIRST: make_state(12.0)})


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

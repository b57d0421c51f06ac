"""The run in progress and the finished runs."""

import threading
from types import SimpleNamespace

from bench.agent.run_executor import PreparedRun
from bench.agent.run_slot import RunSlot

TIMEOUT = 10.0


def prepare(get_status=lambda: "clean", fail=None):
    return PreparedRun(SimpleNamespace(get_status=get_status, log=None, fail=fail), None, None)


def test_finished_run_is_listed_before_its_end_is_reported():
    reports = []
    slot = RunSlot(
        threading.RLock(),
        lambda prepared: None,
        lambda status: reports.append((status, slot.current, slot.finished)),
    )
    assert slot.wait(0)
    assert slot.get_status() is None
    slot.start(prepare())
    assert slot.wait(TIMEOUT)
    assert reports == [("clean", None, ("clean",))]
    assert slot.get_status() == "clean"


def test_status_of_a_run_is_read_without_the_lock():
    """The run may itself wait for the lock, which would be a deadlock."""
    lock, results, ended = threading.RLock(), [], threading.Event()

    def try_lock():
        results.append(lock.acquire(timeout=0.2))
        if results[-1]:
            lock.release()

    def get_status():
        thread = threading.Thread(target=try_lock)
        thread.start()
        thread.join()
        return "in progress"

    slot = RunSlot(lock, lambda prepared: ended.wait(TIMEOUT), lambda status: None)
    slot.start(prepare(get_status))
    assert slot.get_status() == "in progress"
    assert results == [True]
    ended.set()
    assert slot.wait(TIMEOUT)


def test_error_of_the_executor_fails_the_run_and_frees_the_slot():
    reasons = []

    def execute(prepared):
        raise ZeroDivisionError("division by zero")

    slot = RunSlot(threading.RLock(), execute, lambda status: None)
    slot.start(prepare(lambda: reasons[-1], reasons.append))
    assert slot.wait(TIMEOUT)
    assert slot.current is None
    assert "ZeroDivisionError" in slot.get_status()

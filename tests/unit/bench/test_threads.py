"""Background threads, and actions with a time limit."""

import threading

import pytest

from bench.threads import BackgroundThread, run_within


class Waiting(BackgroundThread):
    """A thread that waits for its end, and then for a release."""

    def __init__(self, end_time=None):
        super().__init__("waiting", end_time)
        self.release, self.ended = threading.Event(), threading.Event()

    def _run(self):
        self._stopping.wait()
        self.release.wait()
        self.ended.set()


def test_a_thread_ends_with_its_context():
    with Waiting() as thread:
        thread.release.set()
        assert not thread.ended.is_set()
    assert thread.ended.is_set()


def test_a_thread_that_goes_on_is_left_to_itself_after_the_time_for_its_end():
    with Waiting(end_time=0.01) as thread:
        pass
    assert not thread.ended.is_set()
    thread.release.set()
    assert thread.ended.wait(30.0)


def test_a_thread_that_was_never_started_can_be_ended():
    thread = Waiting()
    thread.__exit__(None, None, None)
    assert not thread.ended.is_set()


def test_the_result_and_the_exception_of_an_action_are_passed_on():
    def fail():
        raise ValueError("wrong")

    assert run_within(30.0, lambda: 7, "action") == 7
    with pytest.raises(ValueError, match="wrong"):
        run_within(30.0, fail, "action")


def test_an_action_that_takes_too_long_is_left_to_itself():
    release = threading.Event()
    with pytest.raises(TimeoutError):
        run_within(0.01, release.wait, "action")
    release.set()

"""Priority of a worker, within its session and of the session itself."""

import os

import pytest

from bench.jobs.worker import lower_priority


@pytest.fixture
def niceness(monkeypatch):
    """Niceness that processes of this test are given, instead of their own."""
    given = []
    monkeypatch.setattr(os, "nice", given.append)
    return given


def test_a_worker_with_a_session_of_its_own_lowers_the_session(tmp_path, monkeypatch, niceness):
    monkeypatch.setattr(os, "getsid", lambda process: os.getpid())
    lower_priority(19, tmp_path / "autogroup")
    assert niceness == [19]
    assert (tmp_path / "autogroup").read_text() == "19"


def test_the_session_of_somebody_else_is_left_alone(tmp_path, monkeypatch, niceness):
    monkeypatch.setattr(os, "getsid", lambda process: os.getpid() + 1)
    lower_priority(19, tmp_path / "autogroup")
    assert niceness == [19]
    assert not (tmp_path / "autogroup").exists()


def test_a_system_without_groups_of_sessions_is_no_error(tmp_path, monkeypatch, niceness):
    monkeypatch.setattr(os, "getsid", lambda process: os.getpid())
    lower_priority(5, tmp_path / "missing" / "autogroup")
    assert niceness == [5]

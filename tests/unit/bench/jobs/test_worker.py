"""Connection of a worker to its scheduler."""

import os

import pytest

from bench.jobs.errors import WorkerError
from bench.jobs.worker import find_scheduler, run_worker


@pytest.mark.parametrize("address", ["nowhere", "tcp://", "tcp://host:port"])
def test_a_worker_with_a_wrong_scheduler_address_is_refused_before_it_starts(address, monkeypatch):
    monkeypatch.setattr(os, "nice", lambda by: pytest.fail("the worker was started"))
    with pytest.raises(WorkerError, match="not of the form tcp://HOST:PORT"):
        run_worker(address, 19)


def test_a_worker_finds_the_scheduler_by_the_data_folder_of_the_service(tmp_path):
    with pytest.raises(WorkerError, match=r"no service uses .*: start one \(mrbench serve\)"):
        find_scheduler(tmp_path)
    (tmp_path / "scheduler.address").write_text("tcp://127.0.0.1:4567")
    assert find_scheduler(tmp_path) == "tcp://127.0.0.1:4567"

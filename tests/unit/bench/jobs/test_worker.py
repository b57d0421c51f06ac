"""Connection of a worker to its scheduler."""

import pytest

from bench.jobs.errors import WorkerError
from bench.jobs.scheduler import find_scheduler


def test_a_worker_finds_the_scheduler_by_the_data_folder_of_the_service(tmp_path):
    with pytest.raises(WorkerError, match=r"no service uses .*: start one \(mrbench serve\)"):
        find_scheduler(tmp_path)
    (tmp_path / "scheduler.address").write_text("tls://127.0.0.1:4567")
    assert find_scheduler(tmp_path) == "tls://127.0.0.1:4567"

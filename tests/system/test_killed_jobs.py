"""Service and worker killed at random moments of jobs: one result for each job, and no process left over.

More repeats: ``MRBENCH_KILLS=100 pytest tests/system/test_killed_jobs.py``.
"""

import os
import random
import signal
import time

import pytest

from tests.support.quick_jobs import COMMAND
from tests.support.service_logs import write_complete_log
from tests.system.test_service import (
    ServiceProcess,
    find_job_processes,
    has_ended,
    is_running,
    wait_until_false,
)

KILLS = int(os.environ.get("MRBENCH_KILLS", "5"))
LATEST_KILL = 6.0
"""Latest moment of a kill, after the service answers [s]; both jobs take about five seconds with their start."""

pytestmark = pytest.mark.timeout(300)


@pytest.mark.parametrize("seed", range(KILLS))
def test_a_kill_at_any_moment_leaves_one_result_for_each_job_and_no_process(tmp_path, seed):
    data = tmp_path / "runs"
    data.mkdir()
    write_complete_log(data / "run.mcap")
    draw = random.Random(seed)
    service = ServiceProcess(data, command=COMMAND)
    try:
        _pause(draw.uniform(0.0, LATEST_KILL))
        service = _kill_one(service, data, draw.choice(["worker", "service", "both"]))
        _check_jobs(service, data)
    finally:
        service.end()
    wait_until_false(lambda: find_job_processes(data), "processes of a job still run")


def _kill_one(service, data, victim):
    """Kill worker, service or both, and return the service that runs afterwards."""
    processes = find_job_processes(data)
    if victim != "service":
        os.kill(service.find_worker(), signal.SIGKILL)
    if victim != "worker":
        service.kill()
        service = ServiceProcess(data, service.token, COMMAND)
    wait_until_false(lambda: any(map(is_running, processes)), f"commands still run after a kill of {victim}")
    return service


def _check_jobs(service, data):
    for kind, folder in (("identify", "fit"), ("diagnose", "diagnosis")):
        job = service.wait_for_job(has_ended, kind)
        assert (job["state"], job["fraction"]) == ("done", 1.0), job["error"]
        assert 1 <= job["attempts"] <= 2
        assert len(list(data.glob(f"run.{folder}-*"))) == 1
    assert not list(data.glob(".run.*")), "the folder of an attempt still exists"
    (run,) = service.call("runs")["items"]
    assert (run["diagnosis"]["verdict"], len(run["jobs"])) == ("explained", 2)


def _pause(seconds):
    """Wait for a random moment: no condition is waited for."""
    time.sleep(seconds)

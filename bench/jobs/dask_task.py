"""Dask task that executes one job in a worker, with progress messages and cancellation through the scheduler."""

import os
import time
from typing import Any

from distributed import Event, get_worker

from bench.jobs.job_spec import FitSummary, JobSpec
from bench.jobs.work import JobCallbacks, execute_job

TOPIC = "mrbench-jobs"
"""Topic for progress: `{"job": id, "activity": message}`; the message is empty when a worker starts a job."""


_EVENT: Any = Event
"""Untyped in dask."""


def make_cancel_flag(job_id: str) -> str:
    """Return the name of the flag that cancels a job; dask forgets a cancelled task but does not stop it."""
    return f"mrbench-cancel-{job_id}"


def run_dask_task(spec: JobSpec) -> FitSummary:
    """Execute a job in a worker.

    Raises:
        JobError: the job failed.
        JobCancelledError: the cancel flag was set.
    """
    worker = get_worker()
    flag: Any = _EVENT(make_cancel_flag(spec.job_id))

    def report(message: str) -> None:
        content = {"job": spec.job_id, "activity": message, "worker": os.getpid(), "at": time.time()}
        worker.log_event(TOPIC, content)

    report("")
    return execute_job(spec, JobCallbacks(report, flag.is_set))

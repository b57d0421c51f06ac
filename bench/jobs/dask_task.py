"""Dask task that executes one job in a worker, with progress messages and cancellation through the scheduler."""

import os
import time
from typing import Any

from distributed import Event, get_worker

from bench.jobs.job_spec import JobSpec, ResultSummary
from bench.jobs.progress import JobProgress
from bench.jobs.work import JobCallbacks, execute_job

TOPIC = "mrbench-jobs"
"""Topic for progress: `{"job": id, "progress": document}`; the progress is null when a worker starts a job."""


_EVENT: Any = Event
"""Untyped in dask."""


def make_cancel_flag(spec: JobSpec) -> str:
    """Return the name of the flag that cancels a job; dask forgets a cancelled task but does not stop it.

    Each submission has its own flag, so that a job that is tried again is not cancelled with its predecessor.
    """
    return f"mrbench-cancel-{spec.job_id}-{spec.submission}"


def run_dask_task(spec: JobSpec) -> ResultSummary:
    """Execute a job in a worker.

    Raises:
        JobError: the job failed.
        JobCancelledError: the cancel flag was set.
    """
    worker = get_worker()
    flag: Any = _EVENT(make_cancel_flag(spec))

    def report(progress: JobProgress | None) -> None:
        document = progress.to_document() if progress else None
        content = {"job": spec.job_id, "progress": document, "worker": os.getpid(), "at": time.time()}
        worker.log_event(TOPIC, content)

    report(None)
    return execute_job(spec, JobCallbacks(report, flag.is_set))

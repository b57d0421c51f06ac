"""Recording of a run through the service, and waiting for its jobs."""

import contextlib
import time
from collections.abc import Callable
from typing import Any

from bench.demo.api_client import ApiClient
from bench.errors import RunError
from bench.progress import Progress

_POLL_PERIOD = 0.25
"""Time [s] between two requests."""
_RUN_MARGIN = 60.0
"""Time [s] that a run may last beyond its planned duration."""
_JOB_TIMEOUT = 900.0
"""Longest time [s] of an identification or a diagnosis."""
_STOP_TIMEOUT = 30.0
"""Longest time [s] until cancelled jobs have stopped."""
_MAX_ATTEMPTS = 3
"""Largest number of runs of a method: on a busy machine late setpoints can make the interlocks end a run."""
_FINAL_STATES = ("done", "failed", "cancelled")


class UncleanRunError(RunError):
    """The outcome of a run is not `clean`."""


def record(
    api: ApiClient,
    method: str,
    progress: Progress,
    on_retry: Callable[[str], None] = lambda message: None,
) -> str:
    """Run a method, and repeat it if the run is not clean.

    Args:
        api: client of the service.
        method: name of a shipped method.
        progress: receives the completed share.
        on_retry: receives the reason of a repetition.

    Returns:
        Id of the run.

    Raises:
        RunError: the run could not be started, was never clean, or does not end.
    """
    for attempt in range(1, _MAX_ATTEMPTS):
        try:
            return _run(api, method, progress)
        except UncleanRunError as error:
            on_retry(f"{error}; attempt {attempt + 1} of {_MAX_ATTEMPTS}")
            api.post("/bench/reset", {})
    return _run(api, method, progress)


def _run(api: ApiClient, method: str, progress: Progress) -> str:
    run = api.post("/runs", {"method": method, "operator": "demo"})
    deadline = time.monotonic() + (run["duration_s"] or 0.0) + _RUN_MARGIN
    while run["state"] == "running":
        if time.monotonic() > deadline:
            raise RunError(f"the run of {method} has not ended {_RUN_MARGIN:g} s after its planned end")
        if state := run["progress"]:
            progress(state["elapsed_s"] / state["duration_s"])
        time.sleep(_POLL_PERIOD)
        run = api.get(f"/runs/{run['id']}")
    if run["outcome"] != "clean":
        raise UncleanRunError(f"the run of {method} is {run['outcome'] or run['state']}: {run['reason']}")
    return str(run["id"])


def await_job(api: ApiClient, run_id: str, kind: str) -> dict[str, Any]:
    """Wait for the identification or diagnosis of a run, and return its job.

    Args:
        api: client of the service.
        run_id: id of the run.
        kind: ``identify`` or ``diagnose``.

    Raises:
        RunError: the job failed or takes too long.
    """
    deadline = time.monotonic() + _JOB_TIMEOUT
    while not (job := _find_job(api, run_id, kind)) or job["state"] not in _FINAL_STATES:
        if time.monotonic() > deadline:
            raise RunError(f"the job {kind} of {run_id} has not ended within {_JOB_TIMEOUT:g} s")
        time.sleep(_POLL_PERIOD)
    if job["state"] != "done":
        raise RunError(f"the job {kind} of {run_id} {job['state']}: {job['error']}")
    return job


def _find_job(api: ApiClient, run_id: str, kind: str) -> dict[str, Any] | None:
    jobs: list[dict[str, Any]] = api.get(f"/runs/{run_id}")["jobs"]
    return next((job for job in jobs if job["kind"] == kind), None)


def cancel_jobs(api: ApiClient) -> None:
    """Cancel all unfinished jobs and wait until they have stopped, so that none is left running or half written.

    Raises:
        RunError: a job does not stop.
    """
    deadline = time.monotonic() + _STOP_TIMEOUT
    asked: set[str] = set()
    while jobs := api.get("/jobs?state=queued&state=running")["items"]:
        if time.monotonic() > deadline:
            raise RunError(f"{len(jobs)} jobs have not stopped within {_STOP_TIMEOUT:g} s")
        for job in jobs:
            if job["id"] not in asked:
                asked.add(job["id"])
                # A job that ends at this moment is refused, and is not in the list any more.
                with contextlib.suppress(RunError):
                    api.post(f"/jobs/{job['id']}/cancel", {})
        time.sleep(_POLL_PERIOD)

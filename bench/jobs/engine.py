"""Engine that executes jobs: its interface to the service, and the implementation with dask."""

import asyncio
import contextlib
import logging
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any, Protocol

from distributed import Client, Event, KilledWorker
from distributed.client import FutureCancelledError

from bench.catalogue import CatalogueUnavailableError
from bench.jobs.dask_task import TOPIC, make_cancel_flag, run_dask_task
from bench.jobs.errors import JobCancelledError, JobError
from bench.jobs.job_spec import JobSpec, ResultSummary
from bench.jobs.progress import JobProgress
from bench.jobs.scheduler import MAX_ATTEMPTS, WORKER_STATES, describe_workers
from bench.jobs.tls import SchedulerLocation

_CONNECT_TIMEOUT = 10.0
"""Time [s] within which a scheduler must reply."""
_POLL_PERIOD = 2.0
"""Time [s] between two checks of the connection to the scheduler."""
_RELEASE_TIMEOUT = 10.0
"""Time [s] within which a cancelled job must have stopped."""
_REPORT_PAUSE = 5.0
"""Time [s] before the end of a job is reported again, if the catalogue could not be written."""
_STATE_LIFETIME = 0.5
"""Time [s] for which the state of the workers is kept, because each question goes to the scheduler."""
_LOG = logging.getLogger(__name__)
_CLIENT: Any = Client
_EVENT: Any = Event
"""Both untyped in dask."""


class JobListener(Protocol):
    """Receiver of the progress and results of jobs; called in the event loop."""

    async def on_started(self, job_id: str) -> None:
        """Handle the start of a job by a worker."""

    async def on_progress(self, job_id: str, progress: JobProgress) -> None:
        """Handle the progress of a job."""

    async def on_done(self, job_id: str, summary: ResultSummary) -> None:
        """Handle the result of a job."""

    async def on_failed(self, job_id: str, reason: str) -> None:
        """Handle the failure of a job."""

    async def on_cancelled(self, job_id: str) -> None:
        """Handle the end of a cancelled job."""

    async def on_connected(self) -> None:
        """Handle a new or restored connection to a scheduler: submit all unfinished jobs."""


class JobEngine(Protocol):
    """Executor of jobs; keeps nothing when it ends."""

    async def start(self, listener: JobListener) -> None:
        """Connect and start to report to a listener."""

    async def submit(self, spec: JobSpec) -> None:
        """Submit a job; one with the key of a job in progress is not started twice."""

    async def cancel(self, job_id: str, *, started: bool) -> None:
        """Cancel a job, also one that a worker has started."""

    async def release(self, job_id: str) -> None:
        """Wait until the end of a finished job has been reported, so that it can be submitted again.

        Raises:
            JobError: its worker has not stopped it in time.
        """

    async def describe_state(self) -> str:
        """Return ``ok`` or what is missing."""

    async def close(self) -> None:
        """Disconnect; the listener is not called any more."""


@dataclass(eq=False)
class _Submission:
    """A job at the scheduler."""

    spec: JobSpec
    future: Any
    task: asyncio.Task[None] | None = None
    """Follows the job to its end."""


class DaskEngine:
    """Engine that runs jobs as dask tasks under the key of their content."""

    def __init__(self, location: SchedulerLocation) -> None:
        """Set the scheduler's address and credentials; `start` connects."""
        self._address, self._security = location
        self._client: Any = None
        self._listener: JobListener | None = None
        self._is_announced = False
        self._submissions: dict[str, _Submission] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._asking, self._asked_at, self._worker_state = asyncio.Lock(), float("-inf"), ""

    async def start(self, listener: JobListener) -> None:
        """Connect, and reconnect whenever the scheduler is restarted."""
        self._listener = listener
        await self._connect()
        self._start_task(self._stay_connected())

    async def submit(self, spec: JobSpec) -> None:
        """Submit a job to the scheduler and follow it."""
        # Without a scheduler nothing is lost: `on_connected` submits the job again.
        if self._client is None or spec.job_id in self._submissions:
            return
        future = self._client.submit(run_dask_task, spec, key=spec.key, pure=True)
        submission = self._submissions[spec.job_id] = _Submission(spec, future)
        submission.task = self._start_task(self._follow_job(submission))

    async def cancel(self, job_id: str, *, started: bool) -> None:
        """Set the cancel flag; a task that was not started is removed at once."""
        submission = self._submissions.get(job_id)
        if self._client is None or submission is None:
            return
        await _EVENT(make_cancel_flag(submission.spec), client=self._client).set()
        if not started:
            await self._client.cancel(submission.future)

    async def release(self, job_id: str) -> None:
        """Wait until a job is no longer followed.

        Raises:
            JobError: its worker has not stopped it in time.
        """
        submission = self._submissions.get(job_id)
        if submission is None or submission.task is None:
            return
        await asyncio.wait([submission.task], timeout=_RELEASE_TIMEOUT)
        if not submission.task.done():
            raise JobError(f"job {job_id} has not stopped within {_RELEASE_TIMEOUT:g} s; try again later")

    async def describe_state(self) -> str:
        """Return ``ok`` if all workers answer, otherwise what is missing; asked for at most twice a second."""
        if self._client is None:
            return f"no scheduler at {self._address}"
        async with self._asking:
            if time.monotonic() - self._asked_at > _STATE_LIFETIME:
                self._worker_state = await self._ask_for_workers(self._client)
                self._asked_at = time.monotonic()
            return self._worker_state

    async def _ask_for_workers(self, client: Any) -> str:
        try:
            states = await asyncio.wait_for(getattr(client.scheduler, WORKER_STATES)(), 1.0)
        except (TimeoutError, OSError, ValueError):
            return f"the scheduler at {self._address} does not reply"
        return describe_workers(states)

    async def close(self) -> None:
        """Disconnect; the tasks continue on a scheduler that was not started here."""
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._client is not None:
            with contextlib.suppress(OSError, TimeoutError):
                await self._client.close(timeout=2)

    async def _connect(self) -> None:
        try:
            client = await _CLIENT(
                self._address,
                security=self._security,
                asynchronous=True,
                timeout=_CONNECT_TIMEOUT,
                set_as_default=False,
            )
        except (OSError, TimeoutError, ValueError) as error:
            _LOG.warning("scheduler_absent", extra={"address": self._address, "why": str(error)})
            return
        client.subscribe_topic(TOPIC, self._on_event)
        self._client, self._is_announced = client, False
        await self._announce()

    async def _announce(self) -> None:
        """Have all unfinished jobs submitted; this is tried again while the catalogue cannot be read."""
        if self._client is None or self._listener is None or self._is_announced:
            return
        try:
            await self._listener.on_connected()
        except CatalogueUnavailableError as error:
            _LOG.warning("jobs_not_submitted", extra={"why": str(error)})
        else:
            self._is_announced = True

    async def _stay_connected(self) -> None:
        while True:
            await asyncio.sleep(_POLL_PERIOD)
            if self._client is None or self._client.status in ("closed", "closing"):
                self._client, self._submissions = None, {}
                await self._connect()
            await self._announce()

    async def _on_event(self, event: tuple[float, dict[str, Any]]) -> None:
        _, content = event
        if self._listener is None or content["job"] not in self._submissions:
            return
        try:
            if content["progress"]:
                await self._listener.on_progress(content["job"], JobProgress(**content["progress"]))
            else:
                await self._listener.on_started(content["job"])
        except CatalogueUnavailableError as error:  # the end of the job is reported until it is recorded
            _LOG.warning("job_progress_not_recorded", extra={"job": content["job"], "why": str(error)})

    async def _follow_job(self, submission: _Submission) -> None:
        job_id = submission.spec.job_id
        report = await self._await_outcome(job_id, submission.future)
        submission.future.release()
        if report is not None:
            await _report_end(report, job_id)
        # After a lost connection the job may already have been submitted again.
        if self._submissions.get(job_id) is submission:
            del self._submissions[job_id]

    async def _await_outcome(self, job_id: str, future: Any) -> Callable[[], Awaitable[None]] | None:
        """Wait for the end of a job and return the call that reports it.

        Returns:
            None if only the scheduler ended: the job will be submitted again.
        """
        listener = self._listener
        if listener is None:
            return None
        try:
            summary = await future
        except JobError as error:
            reason = str(error)
        except JobCancelledError:
            return lambda: listener.on_cancelled(job_id)
        except FutureCancelledError:
            connected = self._client is not None and self._client.status == "running"
            return (lambda: listener.on_cancelled(job_id)) if connected else None
        except KilledWorker:
            reason = f"its worker was lost {MAX_ATTEMPTS} times; check the memory and the worker's log"
        except Exception as error:
            # A worker of another version or machine can raise any exception; it must still be reported.
            _LOG.exception("job_defect", extra={"job": job_id})
            reason = f"{type(error).__name__}: {error}"
        else:
            return lambda: listener.on_done(job_id, summary)
        return lambda: listener.on_failed(job_id, reason)

    def _start_task(self, work: Any) -> asyncio.Task[None]:
        task: asyncio.Task[None] = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task


async def _report_end(report: Callable[[], Awaitable[None]], job_id: str) -> None:
    """Report the end of a job, again and again while the catalogue cannot be written, such as on a full disk."""
    while True:
        try:
            return await report()
        except (OSError, CatalogueUnavailableError) as error:
            _LOG.warning("job_end_not_recorded", extra={"job": job_id, "why": str(error).splitlines()[0]})
        await asyncio.sleep(_REPORT_PAUSE)

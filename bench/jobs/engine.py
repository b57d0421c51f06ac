"""Engine that executes jobs: its interface to the service, and the implementation with dask."""

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any, Protocol

import dask
from distributed import Client, Event, KilledWorker, Scheduler
from distributed.client import FutureCancelledError

from bench.jobs.dask_task import TOPIC, make_cancel_flag, run_dask_task
from bench.jobs.errors import JobCancelledError, JobError, WorkerError
from bench.jobs.job_spec import FitSummary, JobSpec

LOOPBACK = "127.0.0.1"
MAX_ATTEMPTS = 3
"""Number of times that a job is started before it counts as failed."""
_CONNECT_TIMEOUT = 10.0
"""Time [s] within which a scheduler must reply."""
_POLL_PERIOD = 2.0
"""Time [s] between two checks of the connection to the scheduler."""
_LOG = logging.getLogger(__name__)
_CLIENT: Any = Client
_EVENT: Any = Event
"""Both untyped in dask."""


class JobListener(Protocol):
    """Receiver of the progress and results of jobs; called in the event loop."""

    async def on_started(self, job_id: str) -> None:
        """Handle the start of a job by a worker."""

    async def on_progress(self, job_id: str, message: str) -> None:
        """Handle a progress message."""

    async def on_done(self, job_id: str, summary: FitSummary) -> None:
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

    async def describe_state(self) -> str:
        """Return ``ok`` or what is missing."""

    async def close(self) -> None:
        """Disconnect; the listener is not called any more."""


@contextlib.asynccontextmanager
async def start_local_scheduler(data: Path) -> AsyncIterator[str]:
    """Run a scheduler on the loopback interface, and write its address to the data folder meanwhile.

    Raises:
        WorkerError: it cannot listen.
    """
    settings = {
        # The scheduler's own web pages would give access to its data without a token.
        "distributed.scheduler.http.routes": [],
        # Dask counts tolerated failures, not attempts.
        "distributed.scheduler.allowed-failures": MAX_ATTEMPTS - 1,
    }
    with dask.config.set(settings):
        # The scheduler opens a port for web pages in any case; port 0 avoids the well-known default.
        pages = f"{LOOPBACK}:0"
        scheduler = Scheduler(host=LOOPBACK, port=0, protocol="tcp", dashboard_address=pages, dashboard=False)
    try:
        await scheduler
    except OSError as error:
        raise WorkerError(f"the job scheduler cannot listen at {LOOPBACK}: {error}") from error
    address_file = get_scheduler_file(data)
    try:
        address_file.write_text(scheduler.address, encoding="utf-8")
        yield scheduler.address
    finally:
        address_file.unlink(missing_ok=True)
        await scheduler.close()


def get_scheduler_file(data: Path) -> Path:
    """Return the file with the scheduler's address in a data folder."""
    return data / "scheduler.address"


class DaskEngine:
    """Engine that runs jobs as dask tasks under the key of their content."""

    def __init__(self, address: str) -> None:
        """Set the scheduler's address; `start` connects."""
        self._address = address
        self._client: Any = None
        self._listener: JobListener | None = None
        self._futures: dict[str, Any] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    async def start(self, listener: JobListener) -> None:
        """Connect, and reconnect whenever the scheduler is restarted."""
        self._listener = listener
        await self._connect()
        self._start_task(self._stay_connected())

    async def submit(self, spec: JobSpec) -> None:
        """Submit a job to the scheduler and follow it."""
        # Without a scheduler nothing is lost: `on_connected` submits the job again.
        if self._client is None or spec.job_id in self._futures:
            return
        future = self._client.submit(run_dask_task, spec, key=spec.key, pure=True)
        self._futures[spec.job_id] = future
        self._start_task(self._follow_job(spec.job_id, future))

    async def cancel(self, job_id: str, *, started: bool) -> None:
        """Set the cancel flag; a task that was not started is removed at once."""
        future = self._futures.get(job_id)
        if self._client is None or future is None:
            return
        await self._get_cancel_event(job_id).set()
        if not started:
            await self._client.cancel(future)

    async def describe_state(self) -> str:
        """Return ``ok`` if a worker is connected, otherwise what is missing."""
        if self._client is None:
            return f"no scheduler at {self._address}"
        try:
            workers = await asyncio.wait_for(self._client.nthreads(), 1.0)
        except (TimeoutError, OSError, ValueError):
            return f"the scheduler at {self._address} does not reply"
        return "ok" if workers else "no worker; start one: mrbench worker"

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
                self._address, asynchronous=True, timeout=_CONNECT_TIMEOUT, set_as_default=False
            )
        except (OSError, TimeoutError, ValueError) as error:
            _LOG.warning("scheduler_absent", extra={"address": self._address, "why": str(error)})
            return
        client.subscribe_topic(TOPIC, self._on_event)
        self._client = client
        if self._listener is not None:
            await self._listener.on_connected()

    async def _stay_connected(self) -> None:
        while True:
            await asyncio.sleep(_POLL_PERIOD)
            if self._client is None or self._client.status in ("closed", "closing"):
                self._client, self._futures = None, {}
                await self._connect()

    async def _on_event(self, event: tuple[float, dict[str, Any]]) -> None:
        _, content = event
        if self._listener is None or content["job"] not in self._futures:
            return
        if content["activity"]:
            await self._listener.on_progress(content["job"], content["activity"])
        else:
            await self._listener.on_started(content["job"])

    async def _follow_job(self, job_id: str, future: Any) -> None:
        report = await self._await_outcome(job_id, future)
        # After a lost connection the job may already have another future.
        if self._futures.get(job_id) is future:
            del self._futures[job_id]
            if self._client is not None:
                await self._get_cancel_event(job_id).clear()
        future.release()
        if report is not None:
            await report()

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

    def _get_cancel_event(self, job_id: str) -> Any:
        return _EVENT(make_cancel_flag(job_id), client=self._client)

    def _start_task(self, work: Any) -> None:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

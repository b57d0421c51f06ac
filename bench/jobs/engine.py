"""The engine behind the jobs: what the service asks of it, and how dask does it."""

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path
from typing import Any, Protocol

import dask
from distributed import Client, Event, KilledWorker, Scheduler
from distributed.client import FutureCancelledError

from bench.jobs.dask_task import TOPIC, cancel_flag, carry_out_order
from bench.jobs.errors import JobCancelledError, JobError, WorkerError
from bench.jobs.order import Order, Summary

LOOPBACK = "127.0.0.1"
MOST_ATTEMPTS = 3
"""[1] times that a job begins before it has failed."""
_PATIENCE = 10.0
"""[s] for a scheduler to answer."""
_LOOK_EVERY = 2.0
"""[s] between two looks whether the scheduler is still there."""
_LOG = logging.getLogger(__name__)
_CLIENT: Any = Client
_EVENT: Any = Event
"""Both untyped in dask."""


class Listener(Protocol):
    """Who is told what becomes of orders; called in the event loop."""

    async def began(self, job_id: str) -> None:
        """A worker has begun it."""

    async def says(self, job_id: str, words: str) -> None:
        """It says what it is doing."""

    async def done(self, job_id: str, summary: Summary) -> None:
        """It is done."""

    async def failed(self, job_id: str, why: str) -> None:
        """It could not be done."""

    async def cancelled(self, job_id: str) -> None:
        """It has ended because somebody wanted it."""

    async def connected(self) -> None:
        """A scheduler is there, new or again: everything unfinished is to be submitted."""


class Engine(Protocol):
    """Carries out orders somewhere; forgets everything when it ends."""

    async def start(self, listener: Listener) -> None:
        """Begin to listen."""

    async def submit(self, order: Order) -> None:
        """Take an order; one of the same key that is on its way already is not begun twice."""

    async def cancel(self, job_id: str, *, began: bool) -> None:
        """End an order, also one that a worker has begun."""

    async def words(self) -> str:
        """``ok``, or what is missing."""

    async def close(self) -> None:
        """Let go; nobody is told any more."""


@contextlib.asynccontextmanager
async def local_scheduler(data: Path) -> AsyncIterator[str]:
    """A scheduler on the loopback interface; its address stands in the data folder meanwhile.

    Raises:
        WorkerError: it cannot listen.
    """
    settings = {
        # Its own pages show and change what nobody here should see or change.
        "distributed.scheduler.http.routes": [],
        # Dask counts the failures that it forgives, not the attempts.
        "distributed.scheduler.allowed-failures": MOST_ATTEMPTS - 1,
    }
    with dask.config.set(settings):
        # It opens a port for pages in any case; this keeps it off the one that everybody knows.
        pages = f"{LOOPBACK}:0"
        scheduler = Scheduler(host=LOOPBACK, port=0, protocol="tcp", dashboard_address=pages, dashboard=False)
    try:
        await scheduler
    except OSError as error:
        raise WorkerError(f"no scheduler for jobs can listen at {LOOPBACK}: {error}") from error
    place = scheduler_file(data)
    try:
        place.write_text(scheduler.address, encoding="utf-8")
        yield scheduler.address
    finally:
        place.unlink(missing_ok=True)
        await scheduler.close()


def scheduler_file(data: Path) -> Path:
    """The file that names the scheduler of the service that works on a data folder."""
    return data / "scheduler.address"


class DaskEngine:
    """Orders as dask tasks under their content's key."""

    def __init__(self, address: str) -> None:
        """Know the scheduler; nothing is sent yet."""
        self._address = address
        self._client: Any = None
        self._listener: Listener | None = None
        self._futures: dict[str, Any] = {}
        self._tasks: set[asyncio.Task[None]] = set()

    async def start(self, listener: Listener) -> None:
        """Connect, and again whenever the scheduler comes back."""
        self._listener = listener
        await self._connect()
        self._spawn(self._stay_connected())

    async def submit(self, order: Order) -> None:
        """Hand an order to the scheduler and follow it."""
        if self._client is None or order.job_id in self._futures:  # without a scheduler: `connected` asks again
            return
        future = self._client.submit(carry_out_order, order, key=order.key, pure=True)
        self._futures[order.job_id] = future
        self._spawn(self._follow(order.job_id, future))

    async def cancel(self, job_id: str, *, began: bool) -> None:
        """Raise the flag; a task that waits still is forgotten at once."""
        future = self._futures.get(job_id)
        if self._client is None or future is None:
            return
        await self._flag(job_id).set()
        if not began:
            await self._client.cancel(future)

    async def words(self) -> str:
        """``ok`` if a worker is there."""
        if self._client is None:
            return f"no scheduler at {self._address}"
        try:
            workers = await asyncio.wait_for(self._client.nthreads(), 1.0)
        except (TimeoutError, OSError, ValueError):
            return f"the scheduler at {self._address} does not answer"
        return "ok" if workers else "no worker; start one: mrbench worker"

    async def close(self) -> None:
        """End what listens; tasks of another's scheduler go on there."""
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        if self._client is not None:
            with contextlib.suppress(OSError, TimeoutError):
                await self._client.close(timeout=2)

    async def _connect(self) -> None:
        try:
            client = await _CLIENT(self._address, asynchronous=True, timeout=_PATIENCE, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            _LOG.warning("scheduler_absent", extra={"address": self._address, "why": str(error)})
            return
        client.subscribe_topic(TOPIC, self._on_event)
        self._client = client
        if self._listener is not None:
            await self._listener.connected()

    async def _stay_connected(self) -> None:
        while True:
            await asyncio.sleep(_LOOK_EVERY)
            if self._client is None or self._client.status in ("closed", "closing"):
                self._client, self._futures = None, {}
                await self._connect()

    async def _on_event(self, event: tuple[float, dict[str, Any]]) -> None:
        _, said = event
        if self._listener is None or said["job"] not in self._futures:
            return
        if said["doing"]:
            await self._listener.says(said["job"], said["doing"])
        else:
            await self._listener.began(said["job"])

    async def _follow(self, job_id: str, future: Any) -> None:
        tell = await self._ending(job_id, future)
        # After a lost connection the job may be followed anew, by another future.
        if self._futures.get(job_id) is future:
            del self._futures[job_id]
            if self._client is not None:
                await self._flag(job_id).clear()
        future.release()
        if tell is not None:
            await tell()

    async def _ending(self, job_id: str, future: Any) -> Callable[[], Awaitable[None]] | None:
        """How it ended; none where only the scheduler has gone, and the order will be submitted again."""
        listener = self._listener
        if listener is None:
            return None
        try:
            summary = await future
        except JobError as error:
            why = str(error)
        except JobCancelledError:
            return lambda: listener.cancelled(job_id)
        except FutureCancelledError:
            connected = self._client is not None and self._client.status == "running"
            return (lambda: listener.cancelled(job_id)) if connected else None
        except KilledWorker:
            why = f"its worker was lost {MOST_ATTEMPTS} times; look into memory and the worker's log"
        except Exception as error:
            # What a worker of another version or another machine raises cannot be listed; it must reach a person.
            _LOG.exception("job_defect", extra={"job": job_id})
            why = f"{type(error).__name__}: {error}"
        else:
            return lambda: listener.done(job_id, summary)
        return lambda: listener.failed(job_id, why)

    def _flag(self, job_id: str) -> Any:
        return _EVENT(cancel_flag(job_id), client=self._client)

    def _spawn(self, work: Any) -> None:
        task = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

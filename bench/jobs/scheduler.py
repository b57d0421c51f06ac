"""Scheduler of the jobs: in the process of the service, or in one of its own."""

import asyncio
import contextlib
import signal
from collections.abc import AsyncIterator, Callable, Mapping
from ipaddress import ip_address
from pathlib import Path
from typing import Any, TypedDict
from urllib.parse import urlsplit

import dask
import psutil
from distributed import Scheduler, SchedulerPlugin
from distributed.metrics import time

from bench.jobs.errors import WorkerError
from bench.jobs.tls import LOOPBACK, SchedulerLocation, create_security

MAX_ATTEMPTS = 5
"""Number of times that a job is started before it counts as failed.

A job whose memory is too large kills its worker each time. But starts also end by a power cut or a killed service,
which are not the job's fault and cannot be told apart afterwards. So the number is larger than a crash needs.
"""
HEARTBEAT_LIMIT = 6.0
"""Age [s] of the last heartbeat above which a worker counts as silent.

A worker sends a heartbeat each 0.5 s. The commands of a job are processes of their own, so they do not delay it.
Its own thread reads a log and holds the interpreter for parts of a second. The largest age measured was 1.9 s, at
niceness 19 and with seven busy processes for each core.
"""
WORKER_STATES = "mrbench_worker_states"
"""Name of the request that `measure_worker_states` answers."""
_STOPPED = (psutil.STATUS_STOPPED, psutil.STATUS_TRACING_STOP)
"""States of a process that executes nothing until it is continued."""
WORKER_TTL = 30.0
"""Age [s] of the last heartbeat above which the scheduler gives the job of a worker to another one.

The scheduler compares once in this time, so a job moves after one to two of them. A job that is begun again
loses its work, so the limit is several times the one at which the worker is only named.
"""


@contextlib.asynccontextmanager
async def start_scheduler(
    data: Path,
    host: str = LOOPBACK,
    port: int = 0,
    on_silent_worker: Callable[[int], None] | None = None,
) -> AsyncIterator[SchedulerLocation]:
    """Run a scheduler with TLS, and write its address to the data folder meanwhile.

    Args:
        data: data folder; the credentials are created there unless they exist.
        host: address to listen on.
        port: port to listen on; 0 for any free one.
        on_silent_worker: receives the process id of a worker that was removed after `WORKER_TTL`.

    Raises:
        WorkerError: it cannot listen.
        SecretFileError: the credentials cannot be created, or other users may read them.
    """
    security = create_security(data)
    settings = {
        # The scheduler's own web pages would give access to its data without a token.
        "distributed.scheduler.http.routes": [],
        # Dask counts tolerated failures, not attempts.
        "distributed.scheduler.allowed-failures": MAX_ATTEMPTS - 1,
        "distributed.scheduler.worker-ttl": f"{WORKER_TTL} s",
    }
    with dask.config.set(settings):
        # The scheduler opens a port for web pages in any case; port 0 avoids the well-known default.
        pages = f"{LOOPBACK}:0"
        scheduler = Scheduler(
            host=host, port=port, protocol="tls", security=security, dashboard_address=pages, dashboard=False
        )
    scheduler.handlers[WORKER_STATES] = lambda: measure_worker_states(scheduler)
    if on_silent_worker is not None:
        scheduler.add_plugin(SilentWorkerReport(on_silent_worker))
    try:
        await scheduler
    except OSError as error:
        raise WorkerError(f"the job scheduler cannot listen at {host} port {port}: {error}") from error
    address_file = get_scheduler_file(data)
    try:
        address_file.write_text(scheduler.address, encoding="utf-8")
        yield SchedulerLocation(scheduler.address, security)
    finally:
        address_file.unlink(missing_ok=True)
        await scheduler.close()


class SilentWorkerReport(SchedulerPlugin):
    """Reports each worker that the scheduler removes because it is silent; one that leaves is not reported."""

    def __init__(self, on_silent: Callable[[int], None]) -> None:
        """Set the function that receives the process id of such a worker."""
        self._on_silent = on_silent
        self._pids: dict[str, int] = {}

    def add_worker(self, scheduler: Any, worker: str) -> None:
        """Keep the process id of a new worker: the scheduler forgets it before it reports the removal."""
        self._pids[worker] = scheduler.workers[worker].pid

    def remove_worker(self, scheduler: Any, worker: str, *, stimulus_id: str, **kwargs: Any) -> None:
        """Report the worker if its time to live was the cause."""
        pid = self._pids.pop(worker, None)
        if pid is not None and stimulus_id.startswith("check-worker-ttl"):
            self._on_silent(pid)


class WorkerState(TypedDict):
    """State of a worker as the scheduler knows it and sends it to a client."""

    age: float
    """Time since its last heartbeat [s]."""
    suspended_pid: int
    """Number of its process if the operating system has stopped it, else 0."""


def measure_worker_states(scheduler: Any) -> dict[str, WorkerState]:
    """Return the state of each worker, by its address.

    The scheduler itself measures it, because its clock has stamped the heartbeats. It sees processes of its own
    machine only.
    """
    now = time()
    return {
        worker.address: {
            "age": now - worker.last_seen,
            "suspended_pid": worker.pid if _is_suspended(worker.address, worker.pid) else 0,
        }
        for worker in scheduler.workers.values()
    }


def _is_suspended(address: str, pid: int) -> bool:
    """Return True if the operating system has stopped a process; False if it runs on another machine."""
    host = urlsplit(address).hostname or ""
    try:
        return ip_address(host).is_loopback and psutil.Process(pid).status() in _STOPPED
    except (psutil.Error, ValueError):
        return False


def describe_workers(states: Mapping[str, WorkerState]) -> str:
    """Return ``ok``, or what is missing to execute jobs.

    Args:
        states: state of each worker, by its address.
    """
    suspended = {address: s["suspended_pid"] for address, s in states.items() if s["suspended_pid"]}
    silent = {address: s["age"] for address, s in states.items() if s["age"] > HEARTBEAT_LIMIT}
    moved = f"its job is given to another worker within {2 * WORKER_TTL:.0f} s"
    if not states:
        return "no worker; start one: mrbench worker"
    if suspended:
        pids = " ".join(map(str, suspended.values()))
        verb = "is" if len(suspended) == 1 else "are"
        return f"{_name(suspended, states)} {verb} suspended; continue with: kill -CONT {pids}; else {moved}"
    if silent:
        return f"no answer from {_name(silent, states)} for {max(silent.values()):.0f} s; {moved}"
    return "ok"


def _name(some: Mapping[str, float], workers: Mapping[str, object]) -> str:
    return "the worker" if len(workers) == 1 else f"{len(some)} of {len(workers)} workers ({', '.join(some)})"


def run_scheduler(data: Path, host: str, port: int, print_line: Callable[[str], None]) -> None:
    """Run a scheduler until the process receives a signal.

    Args:
        data: data folder of the service.
        host: address to listen on.
        port: port to listen on; 0 for any free one.
        print_line: receives the address when the scheduler listens.

    Raises:
        WorkerError: it cannot listen, or the data folder cannot be written to.
        SecretFileError: the credentials cannot be created, or other users may read them.
    """
    try:
        data.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise WorkerError(f"{data}: cannot be written to ({error.strerror}); use another --data") from error
    asyncio.run(_run(data, host, port, print_line))


async def _run(data: Path, host: str, port: int, print_line: Callable[[str], None]) -> None:
    stop_requested = asyncio.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(number, stop_requested.set)
    async with start_scheduler(data, host, port) as location:
        print_line(location.address)
        await stop_requested.wait()


def get_scheduler_file(data: Path) -> Path:
    """Return the file with the scheduler's address in a data folder."""
    return data / "scheduler.address"


def find_scheduler(data: Path) -> str:
    """Return the address of the scheduler of the service that uses a data folder.

    Raises:
        WorkerError: no service uses it.
    """
    try:
        return get_scheduler_file(data).read_text("utf-8")
    except OSError:
        raise WorkerError(
            f"no service uses {data}: start one (mrbench serve), or give the scheduler: --scheduler tls://…"
        ) from None

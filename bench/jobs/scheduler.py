"""Scheduler of the jobs: in the process of the service, or in one of its own."""

import asyncio
import contextlib
import signal
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import dask
from distributed import Scheduler

from bench.jobs.errors import WorkerError
from bench.jobs.tls import LOOPBACK, SchedulerLocation, create_security

MAX_ATTEMPTS = 5
"""Number of times that a job is started before it counts as failed.

A job whose memory is too large kills its worker each time. But starts also end by a power cut or a killed service,
which are not the job's fault and cannot be told apart afterwards. So the number is larger than a crash needs.
"""


@contextlib.asynccontextmanager
async def start_scheduler(data: Path, host: str = LOOPBACK, port: int = 0) -> AsyncIterator[SchedulerLocation]:
    """Run a scheduler with TLS, and write its address to the data folder meanwhile.

    Args:
        data: data folder; the credentials are created there unless they exist.
        host: address to listen on.
        port: port to listen on; 0 for any free one.

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
    }
    with dask.config.set(settings):
        # The scheduler opens a port for web pages in any case; port 0 avoids the well-known default.
        pages = f"{LOOPBACK}:0"
        scheduler = Scheduler(
            host=host, port=port, protocol="tls", security=security, dashboard_address=pages, dashboard=False
        )
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

"""Worker process: executes one job at a time, at the lowest priority, until its scheduler ends."""

import asyncio
import logging
import os
import signal
from collections.abc import Callable

import dask
from distributed import Worker
from distributed.comm.addressing import get_address_host_port
from distributed.utils import get_ip, get_ipv6

from bench.jobs.errors import WorkerError
from bench.jobs.tls import SchedulerLocation

_LOG = logging.getLogger(__name__)
_CONNECT_TIMEOUT = "10 s"


def run_worker(scheduler: SchedulerLocation, nice: int) -> None:
    """Execute jobs until the scheduler ends or the process receives a signal.

    Args:
        scheduler: address and credentials.
        nice: niceness of the process, 0 to 19.

    Raises:
        WorkerError: no scheduler replies.
    """
    os.nice(nice)
    asyncio.run(_run(scheduler))
    # The thread of a job cannot be joined; its commands end when the pipe from this process closes.
    os._exit(0)


def _find_worker_address(scheduler: str) -> str:
    """Return the address of the interface that reaches the scheduler; loopback for a scheduler on this machine."""
    host, port = get_address_host_port(scheduler)
    find_ip: Callable[[str, int], str] = get_ipv6 if ":" in host else get_ip
    return find_ip(host, port)


async def _run(scheduler: SchedulerLocation) -> None:
    dask.config.set(
        {
            "distributed.worker.http.routes": [],
            # The memory is used by the processes of a job, not by this one.
            "distributed.worker.memory.terminate": False,
            "distributed.worker.memory.pause": False,
        }
    )
    try:
        # Without a host a worker listens on all interfaces, and it executes any code that it receives.
        host = _find_worker_address(scheduler.address)
        worker = await Worker(
            scheduler.address,
            security=scheduler.security,
            nthreads=1,
            memory_limit=0,
            host=host,
            dashboard=False,
            dashboard_address=f"[{host}]:0" if ":" in host else f"{host}:0",
            death_timeout=_CONNECT_TIMEOUT,
        )
    except (OSError, TimeoutError, ValueError, RuntimeError) as error:  # dask wraps some in a RuntimeError
        raise WorkerError(
            f"no scheduler replied at {scheduler.address} within {_CONNECT_TIMEOUT}; "
            "check the address, that the service is running (mrbench serve), and that --scheduler-tls is its file"
        ) from error
    _LOG.info("worker_ready", extra={"scheduler": scheduler.address})
    stop_requested = asyncio.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(number, stop_requested.set)
    finished = asyncio.create_task(worker.finished())
    signalled = asyncio.create_task(stop_requested.wait())
    await asyncio.wait({finished, signalled}, return_when=asyncio.FIRST_COMPLETED)
    await worker.close(timeout=2, executor_wait=False)

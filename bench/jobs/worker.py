"""The worker process: one job at a time, at the lowest priority, until its scheduler goes."""

import asyncio
import logging
import os
import signal
from pathlib import Path

import dask
from distributed import Worker
from distributed.comm.addressing import get_address_host_port

from bench.jobs.engine import scheduler_file
from bench.jobs.errors import WorkerError

_LOG = logging.getLogger(__name__)
_PATIENCE = "10 s"


def run_worker(scheduler: str, nice: int) -> None:
    """Work until the scheduler goes or the process is told to end.

    Args:
        scheduler: its address, such as ``tcp://127.0.0.1:8786``.
        nice: by how much it stands back behind other processes, 0 to 19.

    Raises:
        WorkerError: there is no scheduler.
    """
    try:
        get_address_host_port(scheduler)
    except ValueError:
        raise WorkerError(f"--scheduler {scheduler}: not of the form tcp://HOST:PORT") from None
    os.nice(nice)
    asyncio.run(_work(scheduler))
    # A job's thread cannot be joined; its commands hang on a pipe of this process and end with it.
    os._exit(0)


def scheduler_of(data: Path) -> str:
    """Address of the scheduler of the service that works on a data folder.

    Raises:
        WorkerError: no service does.
    """
    try:
        return scheduler_file(data).read_text("utf-8")
    except OSError:
        raise WorkerError(
            f"no service works on {data}: start one (mrbench serve), or name a scheduler: --scheduler tcp://…"
        ) from None


async def _work(scheduler: str) -> None:
    dask.config.set(
        {
            "distributed.worker.http.routes": [],
            # Memory is the job's own process's, not this one's.
            "distributed.worker.memory.terminate": False,
            "distributed.worker.memory.pause": False,
        }
    )
    try:
        worker = await Worker(scheduler, nthreads=1, memory_limit=0, dashboard=False, death_timeout=_PATIENCE)
    except (OSError, TimeoutError, ValueError, RuntimeError) as error:  # dask wraps some of them in the last
        raise WorkerError(
            f"no scheduler answers at {scheduler} within {_PATIENCE}; "
            "is the service up (mrbench serve), is this its address?"
        ) from error
    _LOG.info("worker_ready", extra={"scheduler": scheduler})
    ended = asyncio.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        asyncio.get_running_loop().add_signal_handler(number, ended.set)
    gone = asyncio.create_task(worker.finished())
    asked = asyncio.create_task(ended.wait())
    await asyncio.wait({gone, asked}, return_when=asyncio.FIRST_COMPLETED)
    await worker.close(timeout=2, executor_wait=False)

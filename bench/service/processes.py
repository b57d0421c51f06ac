"""The processes that the service starts: a worker that it keeps alive, an agent that outlives it."""

import asyncio
import contextlib
import logging
import subprocess
import time
from collections.abc import AsyncIterator, Sequence
from pathlib import Path

from bench.agent_protocol import ShutDownCommand, StatusCommand
from bench.errors import AgentUnreachableError
from bench.jobs import DaskEngine, start_local_scheduler
from bench.processes import MRBENCH_COMMAND, terminate
from bench.service.agent_monitor import AgentLink
from bench.service.errors import ServiceError

AGENT_TIMEOUT = 90.0
"""[s] from its start to an agent's first answer."""
MAX_RESTART_PAUSE = 30.0
"""[s] between two starts of a worker that ends at once."""
_TERMINATE_TIMEOUT = 5.0
"""[s] for a process to end in good order."""
_LOG = logging.getLogger(__name__)


@contextlib.asynccontextmanager
async def start_local_engine(data: Path, mrbench: Sequence[str] = MRBENCH_COMMAND) -> AsyncIterator[DaskEngine]:
    """An engine with a scheduler in this process and one worker process, which is started again whenever it ends.

    Args:
        data: the data folder; the scheduler's address and the worker's words go there.
        mrbench: the command line.
    """
    async with start_local_scheduler(data) as address:
        command = [*mrbench, "worker", "--scheduler", address]
        keeping = asyncio.create_task(_keep_alive(command, data / "worker.log"))
        try:
            yield DaskEngine(address)
        finally:
            keeping.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await keeping


@contextlib.asynccontextmanager
async def connect_engine(address: str) -> AsyncIterator[DaskEngine]:
    """An engine whose scheduler and workers somebody else has started."""
    yield DaskEngine(address)


async def _keep_alive(command: Sequence[str], log: Path) -> None:
    pause = 1.0
    while True:
        began = time.monotonic()
        process = await asyncio.to_thread(_start_process, command, log)
        _LOG.info("worker_started", extra={"pid": process.pid})
        try:
            status = await asyncio.to_thread(process.wait)
        finally:
            # Cancelled: the thread that waits ends as soon as the process does.
            await asyncio.shield(asyncio.to_thread(terminate, process, _TERMINATE_TIMEOUT))
        _LOG.warning("worker_ended", extra={"pid": process.pid, "status": status, "log": str(log)})
        pause = 1.0 if time.monotonic() - began > MAX_RESTART_PAUSE else min(2.0 * pause, MAX_RESTART_PAUSE)
        await asyncio.sleep(pause)


def _start_process(command: Sequence[str], log: Path) -> "subprocess.Popen[bytes]":
    """Start a process in a session of its own, so that a Ctrl-C meant for the service does not reach it."""
    with log.open("ab") as words:
        return subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=words, stderr=words, start_new_session=True
        )


def is_answering(link: AgentLink, timeout: float = 1.0) -> bool:
    """Whether an agent is there.

    Args:
        link: the way to it.
        timeout: [s]
    """
    try:
        return link.send(StatusCommand(), timeout).ok
    except AgentUnreachableError:
        return False


def start_agent(config: Path, link: AgentLink, data: Path, mrbench: Sequence[str] = MRBENCH_COMMAND) -> None:
    """Start a rig agent that goes on when the service ends; returns once it answers.

    Args:
        config: ``bench.toml``.
        link: the way to it.
        data: its words go there, into ``agent.log``.
        mrbench: the command line.

    Raises:
        ServiceError: it ends, or does not answer in time.
    """
    log = data / "agent.log"
    process = _start_process([*mrbench, "rig", "--config", str(config)], log)
    deadline = time.monotonic() + AGENT_TIMEOUT
    while not is_answering(link):
        if process.poll() is not None:
            raise ServiceError(f"the rig agent ended at once: {_read_last_line(log)}")
        if time.monotonic() > deadline:
            terminate(process, _TERMINATE_TIMEOUT)
            raise ServiceError(f"the rig agent did not answer within {AGENT_TIMEOUT:g} s; see {log}")
    _LOG.info("agent_started", extra={"pid": process.pid, "log": str(log)})


def shut_down_idle_agent(link: AgentLink) -> str:
    """End an agent if nothing goes on there.

    Returns:
        What became of it, for a person.
    """
    try:
        status = link.send(StatusCommand(), 2.0).status
        if status is None or status.state != "idle":
            state = status.state if status else "of unknown state"
            return f"the rig agent is {state} and goes on; `mrbench serve` finds it again"
        link.send(ShutDownCommand(), 10.0)
    except AgentUnreachableError as error:
        return f"the rig agent does not answer: {error}"
    return "the rig agent was idle and has ended"


def _read_last_line(log: Path) -> str:
    lines = log.read_text("utf-8", errors="replace").strip().splitlines()
    return lines[-1].removeprefix("mrbench: ") if lines else f"see {log}"

"""Processes that the service starts: a worker, restarted whenever it ends, and an agent that outlives it."""

import asyncio
import contextlib
import logging
import subprocess
import time
from collections.abc import AsyncIterator, Sequence
from pathlib import Path

from bench.agent_protocol import ShutDownCommand, StatusCommand
from bench.config import DEFAULT_BENCH
from bench.errors import AgentUnreachableError
from bench.jobs import DaskEngine, SchedulerLocation, start_scheduler
from bench.processes import MRBENCH_COMMAND, open_privately, terminate
from bench.service.agent_monitor import AgentLink
from bench.service.agent_supervisor import describe_end
from bench.service.errors import ServiceError

AGENT_TIMEOUT = 90.0
"""Time limit from the start of an agent to its first reply [s]."""
MAX_RESTART_PAUSE = 30.0
"""Longest pause between two starts of a worker that keeps failing [s]."""
_TERMINATE_TIMEOUT = 5.0
"""Time for a process to end after SIGTERM before it is killed [s]."""
_LOG = logging.getLogger(__name__)


@contextlib.asynccontextmanager
async def start_local_engine(data: Path, mrbench: Sequence[str] = MRBENCH_COMMAND) -> AsyncIterator[DaskEngine]:
    """Start a scheduler in this process and one worker process, which is restarted whenever it ends or is silent.

    Args:
        data: data folder; it receives address and credentials of the scheduler, and the worker's output.
        mrbench: command that starts mrbench.
    """
    running: dict[int, subprocess.Popen[bytes]] = {}
    async with start_scheduler(data, on_silent_worker=lambda pid: _kill_silent(running.get(pid))) as location:
        command = [*mrbench, "worker", "--scheduler", location.address, "--data", str(data)]
        worker_task = asyncio.create_task(_keep_alive(command, data / "worker.log", running))
        try:
            yield DaskEngine(location)
        finally:
            worker_task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await worker_task


@contextlib.asynccontextmanager
async def connect_engine(location: SchedulerLocation) -> AsyncIterator[DaskEngine]:
    """Connect to an engine whose scheduler and workers were started separately."""
    yield DaskEngine(location)


def _kill_silent(worker: "subprocess.Popen[bytes] | None") -> None:
    """Kill a worker that does not answer, so that another one is started; SIGKILL ends a suspended process too."""
    if worker is not None:
        _LOG.warning("worker_silent", extra={"pid": worker.pid})
        worker.kill()


async def _keep_alive(command: Sequence[str], log: Path, running: "dict[int, subprocess.Popen[bytes]]") -> None:
    """Start a worker again whenever it ends; `running` has the present one by its process id."""
    pause = 1.0
    while True:
        began = time.monotonic()
        process = await asyncio.to_thread(_start_process, command, log)
        running[process.pid] = process
        _LOG.info("worker_started", extra={"pid": process.pid})
        try:
            status = await asyncio.to_thread(process.wait)
        finally:
            # After a cancellation, the waiting thread ends together with the process.
            await asyncio.shield(asyncio.to_thread(terminate, process, _TERMINATE_TIMEOUT))
            del running[process.pid]
        _LOG.warning("worker_ended", extra={"pid": process.pid, "status": status, "log": str(log)})
        pause = 1.0 if time.monotonic() - began > MAX_RESTART_PAUSE else min(2.0 * pause, MAX_RESTART_PAUSE)
        await asyncio.sleep(pause)


def _start_process(command: Sequence[str], log: Path) -> "subprocess.Popen[bytes]":
    """Start a process in a new session, so that it does not receive a Ctrl-C meant for the service."""
    with open_privately(log) as output:
        return subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=output, stderr=output, start_new_session=True
        )


def is_answering(link: AgentLink, timeout: float = 1.0) -> bool:
    """Return whether an agent answers.

    Args:
        link: connection to the agent.
        timeout: time to wait for the reply [s].
    """
    try:
        return link.send(StatusCommand(), timeout).ok
    except AgentUnreachableError:
        return False


def launch_agent(config: Path, log: Path, mrbench: Sequence[str] = MRBENCH_COMMAND) -> "subprocess.Popen[bytes]":
    """Start a rig agent that continues when the service ends, and writes its output to a file."""
    return _start_process([*mrbench, "rig", "--config", str(config)], log)


def get_agent_log(data: Path, bench: str = DEFAULT_BENCH) -> Path:
    """Return the file with the output of a bench's agent in a data folder."""
    return data / ("agent.log" if bench == DEFAULT_BENCH else f"agent-{bench}.log")


def start_agent(
    config: Path, link: AgentLink, log: Path, mrbench: Sequence[str] = MRBENCH_COMMAND
) -> "subprocess.Popen[bytes]":
    """Start a rig agent as `launch_agent` does, and wait until it answers.

    Args:
        config: ``bench.toml``.
        link: connection to the agent.
        log: file that receives its output.
        mrbench: command that starts mrbench.

    Raises:
        ServiceError: the agent ends, or does not answer within `AGENT_TIMEOUT`.
    """
    process = launch_agent(config, log, mrbench)
    deadline = time.monotonic() + AGENT_TIMEOUT
    while not is_answering(link):
        if process.poll() is not None:
            raise ServiceError(f"the rig agent ended at once: {describe_end(process, log)}")
        if time.monotonic() > deadline:
            terminate(process, _TERMINATE_TIMEOUT)
            raise ServiceError(f"the rig agent did not answer within {AGENT_TIMEOUT:g} s; see {log}")
    _LOG.info("agent_started", extra={"pid": process.pid, "log": str(log)})
    return process


def shut_down_idle_agent(link: AgentLink) -> str:
    """Shut down an agent if it is idle.

    Returns:
        Message on the state of the agent, for a person.
    """
    try:
        status = link.send(StatusCommand(), 2.0).status
        if status is None or status.state != "idle":
            state = status.state if status else "in an unknown state"
            return f"the rig agent is {state} and continues; `mrbench serve` connects to it again"
        link.send(ShutDownCommand(), 10.0)
    except AgentUnreachableError as error:
        return f"the rig agent does not answer: {error}"
    return "the rig agent was idle and was shut down"

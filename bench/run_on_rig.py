"""One run on the instruments of a bench, with an agent of its own: no sockets, no service."""

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from bench.agent.agent import Agent
from bench.agent.messages import RunCommand, RunStatus
from bench.agent.ownership import sole_agent
from bench.errors import RunError
from bench.methods import Method
from bench.rig.config import load_config
from drivers.errors import DriverError

_LOOK = 0.2
"""[s] between two looks at how far it is."""


def run_on_rig(
    method: Method,
    config: Path,
    out: Path,
    specimen: str = "",
    operator: str = "",
    progress: Callable[[float], None] = lambda share: None,
    warn: Callable[[str], None] = lambda sentence: None,
) -> RunStatus:
    """Record a method from the instruments that a configuration names.

    Ctrl-C and SIGTERM end it in good order: the motion fades out, the coil goes to zero, the log is closed.

    Args:
        method: what to do.
        config: ``bench.toml``.
        out: the log.
        specimen: the damper under test; empty for what the configuration says.
        operator: who runs it.
        progress: told the share done, 0 to 1.
        warn: told of what the system did not grant.

    Returns:
        How it ended: clean or lossy.

    Raises:
        ConfigError: the configuration does not describe a bench.
        MethodError: the method cannot be compiled within its limits.
        RunError: another agent has the bench, an instrument does not answer, or the run ended before its end; what
            was recorded is in the log.
    """
    found = load_config(config)
    stopping = threading.Event()
    # Signals first: one that comes while the wires are opened must not break off half-way.
    with stopped_by_signals(stopping), sole_agent(config), contextlib.ExitStack() as opened:
        try:
            agent = opened.enter_context(Agent(found, config))
        except DriverError as error:
            raise RunError(str(error)) from error
        for sentence in agent.status().warnings:
            warn(sentence)
        command = RunCommand(
            method=method.model_dump(mode="json", by_alias=True),
            specimen=specimen,
            operator=operator,
            log=str(out),
        )
        answer = agent.run(command)
        if not answer.ok:
            raise RunError(answer.error)
        return _followed(agent, stopping, progress)


def _followed(agent: Agent, stopping: threading.Event, progress: Callable[[float], None]) -> RunStatus:
    """How it ended, stopped in good order where that was asked."""
    asked = False
    while not agent.wait(_LOOK):
        if stopping.is_set() and not asked:
            asked = True
            agent.stop()
        run = agent.run_status()
        if run is not None:
            progress(min(run.elapsed_s / run.duration_s, 1.0) if run.duration_s else 1.0)
    status = agent.run_status()
    if status is None or status.outcome == "incomplete":
        why = "it was not recorded" if status is None else f"{status.reason}; what was recorded is in {status.log}"
        raise RunError(f"the run ended before its end: {why}")
    return status


@contextlib.contextmanager
def stopped_by_signals(stopping: threading.Event) -> Iterator[None]:
    """Let Ctrl-C and SIGTERM set an event instead of ending the process."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    before: dict[int, Any] = {number: signal.signal(number, lambda *_: stopping.set()) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)

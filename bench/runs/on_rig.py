"""Single run on the instruments of a bench, with an agent in this process and no service."""

import contextlib
import threading
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bench.agent import Agent, CommandTrail, acquire_agent_lock, handle_command
from bench.agent_protocol import CommandServer, RunCommand, RunStatus, StopCommand, get_sender, make_endpoint
from bench.audit import make_agent_trail
from bench.catalogue import has_catalogue, open_catalogue
from bench.config import find_bench, load_config
from bench.errors import RunError
from bench.methods import Method
from bench.processes import set_on_signals
from bench.progress import Progress
from drivers import DriverError

_POLL_PERIOD = 0.2
"""[s] Interval at which the progress is polled."""


def run_on_rig(
    method: Method,
    config: Path,
    out: Path,
    specimen: str = "",
    operator: str = "",
    progress: Progress = lambda share: None,
    on_warning: Callable[[str], None] = lambda warning: None,
) -> RunStatus:
    """Record a method on the instruments of a configuration.

    Ctrl-C, SIGTERM and `mrbench stop` stop it softly: the motion fades out, the coil goes to zero, the log is
    closed.

    Args:
        method: the method to run.
        config: ``bench.toml``.
        out: file of the log.
        specimen: the damper under test; empty for the configured one.
        operator: name of the operator.
        progress: receives the completed share, 0 to 1.
        on_warning: receives each privilege that the system did not grant, overdue calibration and failed check.

    Returns:
        The status with its outcome, clean or lossy.

    Raises:
        ConfigError: the configuration is not valid.
        MethodError: the method cannot be compiled within its limits.
        CatalogueError: the catalogue with certificates and checks cannot be opened.
        RunError: the bench belongs to another agent, an instrument does not reply, or the run stopped early; the
            recorded part is in the log.
    """
    bench_config = load_config(config)
    endpoint = make_endpoint(bench_config.agent, config)
    stopping = threading.Event()
    # Signals first: one that comes while the wires are opened must not interrupt half-way.
    with set_on_signals(stopping), acquire_agent_lock(config), contextlib.ExitStack() as opened:
        try:
            server = opened.enter_context(CommandServer(endpoint.commands, endpoint.key))
            trail = opened.enter_context(CommandTrail(make_agent_trail(bench_config, config)))
            agent = opened.enter_context(Agent(bench_config, config))
        except DriverError as error:
            raise RunError(str(error)) from error
        for warning in agent.get_status().warnings:
            on_warning(warning)
        document = method.model_dump(mode="json", by_alias=True)
        command = RunCommand(
            method=document,
            specimen=specimen,
            operator=operator,
            **_read_catalogue(config.parent / bench_config.rig.folder, config),
            log=str(out),
        )
        _start(agent, trail, command)
        run = agent.get_run_status()
        for warning in () if run is None else (*run.calibration_overdue, *run.failed_checks):
            on_warning(warning)
        opened.enter_context(_serve_commands(server, agent, trail, stopping))
        return _follow_run(agent, trail, stopping, progress)


def _start(agent: Agent, trail: CommandTrail, command: RunCommand) -> None:
    """Start a run, and record who has.

    Raises:
        RunError: the agent refuses it, or it could not be recorded.
    """
    command = command.model_copy(update={"sender": get_sender()})
    if obstacle := trail.find_obstacle(command):
        raise RunError(obstacle)
    reply = agent.run(command)
    trail.record(command, "", reply, wait=True)
    if not reply.ok:
        raise RunError(reply.error)


def _read_catalogue(data: Path, config: Path) -> dict[str, Any]:
    """Return today's certificates and the latest checks of a bench from the catalogue of a folder, if it has one.

    Raises:
        ConfigError: the service of this folder has several benches, and none of them is this one.
    """
    if not has_catalogue(data):
        return {}
    bench = find_bench(data, config)
    with open_catalogue(data) as catalogue:
        certificates = catalogue.certificates.list_current(datetime.now(UTC).date(), bench)
        return {"certificates": tuple(certificates.values()), "checks": catalogue.checks.list_latest(bench)}


@contextlib.contextmanager
def _serve_commands(
    server: CommandServer, agent: Agent, trail: CommandTrail, stopping: threading.Event
) -> Iterator[None]:
    """Answer commands of other processes for the duration of a block; the end of the agent stops the run."""
    ended = threading.Event()
    thread = threading.Thread(
        target=server.serve,
        args=(lambda command: handle_command(agent, trail, command, stopping), ended, trail),
        daemon=True,
    )
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def _follow_run(agent: Agent, trail: CommandTrail, stopping: threading.Event, progress: Progress) -> RunStatus:
    """Wait for the end of the run, stop it if requested, and return its status."""
    is_stopping = False
    while not agent.wait(_POLL_PERIOD):
        if stopping.is_set() and not is_stopping:
            is_stopping = True
            trail.record(StopCommand(sender=get_sender()), "signal", agent.stop(), wait=False)
        run = agent.get_run_status()
        if run is not None:
            progress(min(run.elapsed_s / run.duration_s, 1.0) if run.duration_s else 1.0)
    status = agent.get_run_status()
    if status is None or status.outcome == "incomplete":
        reason = (
            "it was not recorded" if status is None else f"{status.reason}; the recorded part is in {status.log}"
        )
        raise RunError(f"the run stopped early: {reason}")
    return status

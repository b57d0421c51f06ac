"""Rig agent as a process: one socket receives commands and returns replies, the other publishes."""

import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from bench.agent.agent import Agent
from bench.agent.command_trail import CommandTrail
from bench.agent.ownership import acquire_agent_lock
from bench.agent_protocol import (
    AbortCommand,
    AuditCommand,
    Command,
    CommandServer,
    DescribeCommand,
    LeaseCommand,
    PauseCommand,
    PrepareCommand,
    Publisher,
    Reply,
    ResetCommand,
    RunCommand,
    ShutDownCommand,
    StatusCommand,
    StopCommand,
    make_endpoint,
)
from bench.audit import make_agent_trail
from bench.config import load_config
from bench.errors import RunError
from bench.processes import set_on_signals
from drivers import DriverError

_BenchCommand: TypeAlias = (
    RunCommand | StopCommand | PauseCommand | AbortCommand | ResetCommand | PrepareCommand | LeaseCommand
)
"""Command that acts on the bench."""


def serve_agent(
    path: Path,
    commands: str | None,
    samples: str | None,
    on_ready: Callable[[str], None],
    on_warning: Callable[[str], None],
) -> None:
    """Run the agent until Ctrl-C, SIGTERM or a command ends it; then bring everything to rest.

    Args:
        path: ``bench.toml``.
        commands: address for commands, instead of the configured one.
        samples: publishing address, instead of the one that belongs to the address for commands.
        on_ready: receives the addresses in one line when the agent is ready.
        on_warning: receives each privilege that the system did not grant.

    Raises:
        ConfigError: the configuration is not valid.
        RunError: the bench belongs to another agent, an address is not available, or an instrument does not reply.
    """
    config = load_config(path)
    endpoint = make_endpoint(config.agent, path, commands, samples)
    stopping = threading.Event()
    with (
        set_on_signals(stopping),
        acquire_agent_lock(path),
        CommandServer(endpoint.commands, endpoint.key) as server,
        Publisher(endpoint.samples, endpoint.key) as publisher,
        CommandTrail(make_agent_trail(config, path)) as trail,
    ):
        try:
            with Agent(config, path, publisher.publish) as agent:
                for warning in agent.get_status().warnings:
                    on_warning(warning)
                on_ready(f"agent of {config.rig.name}: commands {server.address}, samples {publisher.address}")
                sys.stdout.flush()
                server.serve(lambda command: handle_command(agent, trail, command, stopping), stopping, trail)
        except DriverError as error:
            raise RunError(str(error)) from error


def handle_command(agent: Agent, trail: CommandTrail, command: Command, stopping: threading.Event) -> Reply:
    """Execute a received command and return its reply; ``stopping`` is the event that ends the agent."""
    match command:
        case StatusCommand():
            return Reply(ok=True, status=agent.get_status())
        case DescribeCommand():
            return Reply(ok=True, description=agent.describe())
        case AuditCommand():
            return Reply(ok=True, audit=trail.read_page(command))
        case ShutDownCommand():
            stopping.set()
            return Reply(ok=True, status=agent.get_status())
        case _:
            return _execute(agent, command)


def _execute(agent: Agent, command: _BenchCommand) -> Reply:
    match command:
        case RunCommand():
            return agent.run(command)
        case StopCommand():
            return agent.stop()
        case PauseCommand():
            return agent.pause()
        case AbortCommand():
            return agent.abort()
        case ResetCommand():
            return agent.reset()
        case PrepareCommand():
            return agent.prepare(command)
        case LeaseCommand():
            return agent.lease(command)

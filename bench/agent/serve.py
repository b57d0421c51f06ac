"""The rig agent as a process: commands come and answers go over one socket, the other one publishes."""

import sys
import threading
from collections.abc import Callable
from pathlib import Path

from bench.agent.agent import Agent
from bench.agent.link import CommandServer, Publisher
from bench.agent.messages import (
    Answer,
    Command,
    PrepareCommand,
    ResetCommand,
    RunCommand,
    ShutDownCommand,
    StatusCommand,
    StopCommand,
)
from bench.agent.ownership import sole_agent
from bench.errors import RunError
from bench.rig.config import load_config
from bench.run_on_rig import stopped_by_signals
from drivers.errors import DriverError


def serve_agent(
    path: Path,
    commands: str | None,
    samples: str | None,
    say: Callable[[str], None],
    warn: Callable[[str], None],
) -> None:
    """Run the agent until Ctrl-C, SIGTERM or a command ends it; then bring everything to rest.

    Args:
        path: ``bench.toml``.
        commands: address for commands, instead of the configured one.
        samples: address that publishes, instead of the configured one.
        say: told in one line where it listens.
        warn: told of what the system did not grant.

    Raises:
        ConfigError: the configuration does not describe a bench.
        RunError: another agent has the bench, an address cannot be had, or an instrument does not answer.
    """
    config = load_config(path)
    stopping = threading.Event()
    with (
        stopped_by_signals(stopping),
        sole_agent(path),
        CommandServer(commands or config.agent.commands) as server,
        Publisher(samples or config.agent.samples) as publisher,
    ):
        try:
            with Agent(config, path, publisher.publish) as agent:
                for sentence in agent.status().warnings:
                    warn(sentence)
                say(f"agent of {config.rig.name}: commands {server.address}, samples {publisher.address}")
                sys.stdout.flush()
                server.serve(lambda command: answered(agent, command, stopping), stopping)
        except DriverError as error:
            raise RunError(str(error)) from error


def answered(agent: Agent, command: Command, stopping: threading.Event) -> Answer:
    """What the agent answers to a command.

    Args:
        agent: at work.
        command: as it came.
        stopping: set where the agent is to end.
    """
    match command:
        case StatusCommand():
            return Answer(ok=True, status=agent.status())
        case RunCommand():
            return agent.run(command)
        case StopCommand():
            return agent.stop()
        case ResetCommand():
            return agent.reset()
        case PrepareCommand():
            return agent.prepare(command)
        case ShutDownCommand():
            stopping.set()
            return Answer(ok=True, status=agent.status())

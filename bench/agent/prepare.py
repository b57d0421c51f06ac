"""A step before a run, asked of the agent of a bench."""

import time
from pathlib import Path

from bench.agent.link import AgentClient
from bench.agent.messages import AgentStatus, PrepareCommand, StatusCommand, StopCommand
from bench.agent.steps import Step
from bench.errors import RunError
from bench.rig.config import load_config

_LOOK = 0.2
"""[s] between two looks whether it has ended."""
_ANSWER = 10.0
"""[s]"""


def prepare_through_agent(config: Path, step: Step, position: float | None = None) -> str:
    """Ask for a step and wait for its end.

    Args:
        config: ``bench.toml``, which says where the agent listens.
        step: which.
        position: [m] where ``move`` goes.

    Returns:
        What is so now, in words.

    Raises:
        ConfigError: the configuration does not describe a bench.
        AgentUnreachable: no agent answers there.
        RunError: the agent refuses the step, or it fails; the message says why.
    """
    agent = load_config(config).agent
    client = AgentClient(agent.commands, agent.samples)
    try:
        status = _followed(client, PrepareCommand(step=step, position_m=position))
    except KeyboardInterrupt:
        # Whoever interrupts the command wants the rod to stand, and the agent would go on without it.
        client.send(StopCommand())
        raise
    if status.step is None or status.step.outcome == "failed":
        raise RunError(status.trip or (status.step.words if status.step else "the agent was started anew"))
    return f"{status.mounting}: {status.step.words}"


def _followed(client: AgentClient, command: PrepareCommand) -> AgentStatus:
    """The agent's status once a step has ended, and the next one may begin."""
    answer = client.send(command, _ANSWER)
    if not answer.ok or answer.status is None:
        raise RunError(answer.error)
    status = answer.status
    # The agent takes the next step a moment after this one has ended, and no sooner.
    while status.state == "preparing" or (status.step is not None and status.step.outcome == "going"):
        time.sleep(_LOOK)
        status = _status(client)
    return status


def _status(client: AgentClient) -> AgentStatus:
    status = client.send(StatusCommand()).status
    if status is None:
        raise RunError("the agent says nothing of itself; see its output")
    return status

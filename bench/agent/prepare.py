"""A step before a run, asked of the agent of a bench."""

import time
from pathlib import Path
from typing import cast, get_args

from bench.agent.link import AgentClient
from bench.agent.messages import AgentStatus, PrepareCommand, StatusCommand
from bench.agent.steps import Step
from bench.errors import RunError
from bench.rig.config import load_config

_LOOK = 0.2
"""[s] between two looks whether it has ended."""
_ANSWER = 10.0
"""[s]"""


def prepare_through_agent(config: Path, step: str, position: float = 0.0) -> str:
    """Ask for a step and wait for its end.

    Args:
        config: ``bench.toml``, which says where the agent listens.
        step: its name.
        position: [m] where ``move`` goes.

    Returns:
        What is so now, in words.

    Raises:
        ConfigError: the configuration does not describe a bench.
        RunError: there is no such step, no agent, or it refuses or fails; the message says why.
    """
    if step not in get_args(Step):
        raise RunError(f"there is no step {step}; there are {', '.join(get_args(Step))}")
    agent = load_config(config).agent
    client = AgentClient(agent.commands, agent.samples)
    answer = client.send(PrepareCommand(step=cast(Step, step), position_m=position), _ANSWER)
    if not answer.ok or answer.status is None:
        raise RunError(answer.error)
    status = answer.status
    while status.step is not None and status.step.outcome == "going":
        time.sleep(_LOOK)
        status = _status(client)
    if status.step is None or status.step.outcome == "failed":
        raise RunError(status.trip or (status.step.words if status.step else "the agent was started anew"))
    return f"{status.mounting}: {status.step.words}"


def _status(client: AgentClient) -> AgentStatus:
    status = client.send(StatusCommand()).status
    if status is None:
        raise RunError("the agent says nothing of itself; see its output")
    return status

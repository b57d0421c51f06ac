"""Request of a setup step from the agent of a bench."""

import time
from pathlib import Path

from bench.agent_protocol.agent_client import AgentClient
from bench.agent_protocol.commands import PrepareCommand, StatusCommand, StopCommand
from bench.agent_protocol.endpoint import find_agent
from bench.agent_protocol.messages import AgentStatus
from bench.errors import RunError
from bench.setup_steps import SetupStep

_REPLY_TIMEOUT = 10.0
"""[s] Time for the agent's reply."""


def request_setup_step(
    config: Path, step: SetupStep, position: float | None = None, poll_period: float = 0.2
) -> str:
    """Request a setup step and wait for its end; an interrupt stops the rod.

    Args:
        config: ``bench.toml``, which contains the agent's addresses.
        step: the setup step.
        position: target of ``move`` [m].
        poll_period: interval at which the end of the step is polled [s].

    Returns:
        The reference state and the result of the step, for a person.

    Raises:
        ConfigError: the configuration is not valid.
        AgentUnreachableError: no agent replies.
        RunError: the agent refuses the step, or the step fails.
    """
    client = AgentClient(*find_agent(config))
    try:
        status = _await_end(client, PrepareCommand(step=step, position_m=position), poll_period)
    except KeyboardInterrupt:
        # The agent would continue the step without its client.
        client.send(StopCommand())
        raise
    if status.step is None:
        raise RunError(status.trip or "the agent was restarted during the step; repeat it")
    if status.step.outcome == "failed":
        raise RunError(status.trip or status.step.message)
    return f"{status.reference_state}: {status.step.message}"


def _await_end(client: AgentClient, command: PrepareCommand, poll_period: float) -> AgentStatus:
    """Return the agent's status once the step has ended and the next one may begin."""
    reply = client.send(command, _REPLY_TIMEOUT)
    if not reply.ok or reply.status is None:
        raise RunError(reply.error)
    status = reply.status
    # The agent accepts the next step only a moment after this one has ended.
    while status.state == "preparing" or (status.step is not None and status.step.outcome == "running"):
        time.sleep(poll_period)
        status = _get_status(client)
    return status


def _get_status(client: AgentClient) -> AgentStatus:
    status = client.send(StatusCommand()).status
    if status is None:
        raise RunError("the agent's reply contains no status; see the agent's output")
    return status

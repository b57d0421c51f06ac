"""Requests that end a run, a setup step, or the agent of a bench; they need no service."""

import time
from pathlib import Path

from bench.agent_protocol.agent_client import AgentClient
from bench.agent_protocol.commands import AbortCommand, ShutDownCommand, StatusCommand, StopCommand
from bench.agent_protocol.endpoint import find_agent
from bench.agent_protocol.messages import AgentStatus, Message, RunStatus
from bench.errors import AgentUnreachableError, RunError

_POLL_PERIOD = 0.2
"""[s] Interval at which the end is polled."""
_END_TIMEOUT = 60.0
"""[s] Time within which the agent ends: it brings everything to rest before."""


def request_stop(config: Path, *, abort: bool = False) -> str:
    """End what is in progress on a bench, and wait until it has ended.

    Args:
        config: ``bench.toml``.
        abort: stop coil and actuator at once by the path of a trip, instead of a controlled stop.

    Returns:
        What has ended and how, for a person.

    Raises:
        ConfigError: the configuration is not valid.
        AgentUnreachableError: no agent replies.
        RunError: the agent refuses.
    """
    client = AgentClient(*find_agent(config))
    before = _get_status(client, AbortCommand() if abort else StopCommand())
    status = before
    while status.state in ("preparing", "running", "stopping") or _is_recording(status):
        time.sleep(_POLL_PERIOD)
        try:
            status = _get_status(client)
        except AgentUnreachableError:  # the agent of `mrbench run` ends with its run
            return f"{_describe_end(status.run)}; its agent has ended with it"
    if status.state == "tripped":
        return f"tripped: {status.trip}; remove the cause, then reset it on the page or over REST"
    if before.state == "idle":
        return "nothing was in progress; the rig agent is idle"
    if before.state == "preparing":
        return f"the setup step has ended: {status.step.message if status.step else status.reference_state}"
    return _describe_end(status.run)


def request_end(config: Path, *, force: bool = False) -> str:
    """End the agent of a bench if it is idle, and wait until it has ended.

    Args:
        config: ``bench.toml``.
        force: also end a tripped agent, which forgets the trip; everything is at rest then.

    Returns:
        What was done, for a person.

    Raises:
        ConfigError: the configuration is not valid.
        AgentUnreachableError: no agent replies.
        RunError: the agent is busy or tripped, or does not end.
    """
    client = AgentClient(*find_agent(config))
    status = _get_status(client)
    if status.state == "tripped" and not force:
        raise RunError(
            f"the rig agent is tripped ({status.trip}) and was not ended; remove the cause and reset it, "
            "or give --force: the trip is forgotten"
        )
    if status.state not in ("idle", "tripped"):
        raise RunError(f"the rig agent is {status.state} and was not ended; stop it first: mrbench stop")
    client.send(ShutDownCommand())
    deadline = time.monotonic() + _END_TIMEOUT
    while time.monotonic() < deadline:
        try:
            client.send(StatusCommand(), _POLL_PERIOD)
        except AgentUnreachableError:
            return f"the rig agent was {status.state} and has ended"
        time.sleep(_POLL_PERIOD)
    raise RunError(f"the rig agent has not ended within {_END_TIMEOUT:g} s; see its output")


def _get_status(client: AgentClient, command: Message | None = None) -> AgentStatus:
    reply = client.send(command or StatusCommand())
    if not reply.ok or reply.status is None:
        raise RunError(reply.error or "the agent's reply contains no status; see the agent's output")
    return reply.status


def _is_recording(status: AgentStatus) -> bool:
    """Return whether the log of a tripped run is still open."""
    return status.run is not None and status.run.outcome is None


def _describe_end(run: RunStatus | None) -> str:
    if run is None:
        return "what was in progress has ended"
    reason = f" ({run.reason})" if run.reason else ""
    return f"{run.id}: {run.ending or run.outcome or 'ended'}{reason}; log {run.log}"

"""Messages between the rig agent and its clients, and the sockets that carry them."""

from bench.agent_protocol.link import AgentClient, CommandServer, Publisher
from bench.agent_protocol.messages import (
    AgentEvent,
    AgentState,
    AgentStatus,
    Command,
    InstrumentStatus,
    Message,
    PrepareCommand,
    Reply,
    ResetCommand,
    RunCommand,
    RunOutcome,
    RunStatus,
    Samples,
    SetupStatus,
    ShutDownCommand,
    StatusCommand,
    StopCommand,
)
from bench.agent_protocol.setup_client import request_setup_step

__all__ = [
    "AgentClient",
    "AgentEvent",
    "AgentState",
    "AgentStatus",
    "Command",
    "CommandServer",
    "InstrumentStatus",
    "Message",
    "PrepareCommand",
    "Publisher",
    "Reply",
    "ResetCommand",
    "RunCommand",
    "RunOutcome",
    "RunStatus",
    "Samples",
    "SetupStatus",
    "ShutDownCommand",
    "StatusCommand",
    "StopCommand",
    "request_setup_step",
]

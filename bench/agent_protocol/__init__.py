"""Messages between the rig agent and its clients, and the sockets that carry them."""

from bench.agent_protocol.endpoint import AgentEndpoint, derive_samples_address, find_agent, make_endpoint
from bench.agent_protocol.link import AgentClient, CommandServer, Publisher
from bench.agent_protocol.messages import (
    AbortCommand,
    AgentEvent,
    AgentState,
    AgentStatus,
    Command,
    InstrumentStatus,
    LimitStatus,
    Message,
    PauseCommand,
    PrepareCommand,
    Reply,
    ResetCommand,
    RunCommand,
    RunOutcome,
    RunStatus,
    SetupStatus,
    ShutDownCommand,
    StatusCommand,
    StopCommand,
)
from bench.agent_protocol.setup_client import request_setup_step
from bench.agent_protocol.stop_client import request_end, request_stop

__all__ = [
    "AbortCommand",
    "AgentClient",
    "AgentEndpoint",
    "AgentEvent",
    "AgentState",
    "AgentStatus",
    "Command",
    "CommandServer",
    "InstrumentStatus",
    "LimitStatus",
    "Message",
    "PauseCommand",
    "PrepareCommand",
    "Publisher",
    "Reply",
    "ResetCommand",
    "RunCommand",
    "RunOutcome",
    "RunStatus",
    "SetupStatus",
    "ShutDownCommand",
    "StatusCommand",
    "StopCommand",
    "derive_samples_address",
    "find_agent",
    "make_endpoint",
    "request_end",
    "request_setup_step",
    "request_stop",
]

"""Rig agent: the one process that owns the instruments of a bench and executes runs."""

from bench.agent.agent import Agent
from bench.agent.command_trail import CommandTrail
from bench.agent.ownership import acquire_agent_lock
from bench.agent.server import handle_command, serve_agent

__all__ = [
    "Agent",
    "CommandTrail",
    "acquire_agent_lock",
    "handle_command",
    "serve_agent",
]

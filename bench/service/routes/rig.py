"""The rig agent, its instruments, and whether everything is there."""

import asyncio
from importlib.metadata import version

from fastapi import APIRouter

from bench.agent_protocol import AgentStatus, InstrumentStatus, PrepareCommand, StopCommand
from bench.errors import BenchError
from bench.service.context import Context
from bench.service.views import Health, SetupRequest

public_router = APIRouter(tags=["service"])
router = APIRouter(tags=["rig"])


@public_router.get("/health")
async def get_health(context: Context) -> Health:
    """Whether agent and worker are there; needs no token."""
    agent, worker = await asyncio.gather(
        asyncio.to_thread(_describe_agent, context), context.engine.describe_state()
    )
    return Health(version=version("mrbench"), agent=agent, worker=worker)


def _describe_agent(context: Context) -> str:
    try:
        context.monitor.get_status()
    except BenchError as error:
        return str(error)
    return "ok"


@router.get("/agent")
def get_agent(context: Context) -> AgentStatus:
    """What the agent says of itself."""
    return context.monitor.get_status()


@router.post("/agent/reset")
def reset_agent(context: Context) -> AgentStatus:
    """Take back a trip whose cause has gone; nothing moves."""
    return context.monitor.reset()


@router.post("/agent/stop")
def stop_agent(context: Context) -> AgentStatus:
    """End whatever goes on in good order: a run, or a step before one. Harmless when nothing moves."""
    return context.monitor.send_command(StopCommand())


@router.post("/agent/prepare")
def start_setup_step(context: Context, wanted: SetupRequest) -> AgentStatus:
    """One step before a run; where the answer's state is `preparing`, it goes on."""
    return context.monitor.send_command(PrepareCommand(step=wanted.step, position_m=wanted.position_m))


@router.get("/instruments")
def list_instruments(context: Context) -> tuple[InstrumentStatus, ...]:
    """The instruments and their wires."""
    return context.monitor.get_status().instruments

"""Routes of the rig agent, its instruments, and the health of the service."""

import asyncio
from importlib.metadata import version

from fastapi import APIRouter

from bench.agent_protocol import AbortCommand, AgentStatus, InstrumentStatus, PrepareCommand, StopCommand
from bench.errors import BenchError
from bench.service.context import Context
from bench.service.requests import IDEMPOTENT, IdempotentRoute
from bench.service.views import Health, SetupRequest

public_router = APIRouter(tags=["service"])
router = APIRouter(tags=["rig"], route_class=IdempotentRoute)


@public_router.get("/health")
async def get_health(context: Context) -> Health:
    """Return whether agent and worker are available, and whether the disk has space; needs no token."""
    agent, worker = await asyncio.gather(
        asyncio.to_thread(_describe_agent, context), context.engine.describe_state()
    )
    disk = await asyncio.to_thread(context.space_monitor.describe)
    return Health(version=version("mrbench"), agent=agent, worker=worker, disk=disk or "ok")


def _describe_agent(context: Context) -> str:
    try:
        status = context.monitor.get_status()
    except BenchError as error:
        return str(error)
    trip = f"tripped: {status.trip}" if status.state == "tripped" else ""
    return "; ".join(filter(None, (trip, status.notice))) or "ok"


@router.get("/agent")
def get_agent(context: Context) -> AgentStatus:
    """Return the status of the agent."""
    return context.monitor.get_status()


@router.post("/agent/reset")
def reset_agent(context: Context) -> AgentStatus:
    """Reset a trip whose cause is removed; nothing moves."""
    return context.monitor.reset()


@router.post("/agent/stop")
def stop_agent(context: Context) -> AgentStatus:
    """Stop a run or a setup step in a controlled way. Harmless when nothing moves."""
    return context.monitor.send_command(StopCommand())


@router.post("/bench/abort")
def abort_bench(context: Context) -> AgentStatus:
    """Stop coil and actuator at once by the path of a trip; it latches until a reset, also if nothing moves."""
    return context.monitor.send_command(AbortCommand())


@router.post("/agent/prepare", dependencies=[IDEMPOTENT])
def start_setup_step(context: Context, request: SetupRequest) -> AgentStatus:
    """Start a setup step; it continues if the returned state is `preparing`."""
    return context.monitor.send_command(PrepareCommand(step=request.step, position_m=request.position_m))


@router.get("/instruments")
def list_instruments(context: Context) -> tuple[InstrumentStatus, ...]:
    """List the instruments with the state of their wires."""
    return context.monitor.get_status().instruments

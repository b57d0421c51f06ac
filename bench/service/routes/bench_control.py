"""Routes that control the bench: its status, stop, abort, reset, and setup steps."""

from fastapi import APIRouter

from bench.agent_protocol import AbortCommand, AgentStatus, PrepareCommand, StopCommand
from bench.service.audit import note_old
from bench.service.context import Context
from bench.service.requests import IDEMPOTENT, IdempotentRoute
from bench.service.views import SetupRequest

router = APIRouter(prefix="/bench", tags=["bench"], route_class=IdempotentRoute)


@router.get("")
def get_bench(context: Context) -> AgentStatus:
    """Return the status of the bench, as its rig agent knows it."""
    return context.monitor.get_status()


@router.post("/reset")
def reset_bench(context: Context) -> AgentStatus:
    """Reset a trip whose cause is removed; nothing moves."""
    status = context.monitor.latest_status
    note_old(None if status is None else {"state": status.state, "trip": status.trip})
    return context.monitor.reset()


@router.post("/stop")
def stop_bench(context: Context) -> AgentStatus:
    """Stop a run or a setup step in a controlled way. Harmless when nothing moves."""
    return context.monitor.send_command(StopCommand())


@router.post("/abort")
def abort_bench(context: Context) -> AgentStatus:
    """Stop coil and actuator at once by the path of a trip; it latches until a reset, also if nothing moves."""
    return context.monitor.send_command(AbortCommand())


@router.post("/prepare", dependencies=[IDEMPOTENT])
def start_setup_step(context: Context, request: SetupRequest) -> AgentStatus:
    """Start a setup step; it continues if the returned state is `preparing`."""
    return context.monitor.send_command(PrepareCommand(step=request.step, position_m=request.position_m))

"""Routes that control a bench: its status, stop, abort, reset, and setup steps."""

from fastapi import APIRouter

from bench.agent_protocol import AbortCommand, AgentStatus, PrepareCommand, StopCommand
from bench.service.audit import note_old
from bench.service.context import AddressedBench
from bench.service.requests import IDEMPOTENT, IdempotentRoute
from bench.service.views import SetupRequest

router = APIRouter(tags=["bench"], route_class=IdempotentRoute)


@router.get("")
def get_bench(bench: AddressedBench) -> AgentStatus:
    """Return the status of the bench, as its rig agent knows it."""
    return bench.monitor.get_status()


@router.post("/reset")
def reset_bench(bench: AddressedBench) -> AgentStatus:
    """Reset a trip whose cause is removed; nothing moves."""
    status = bench.monitor.latest_status
    note_old(None if status is None else {"state": status.state, "trip": status.trip})
    return bench.monitor.reset()


@router.post("/stop")
def stop_bench(bench: AddressedBench) -> AgentStatus:
    """Stop a run or a setup step in a controlled way. Harmless when nothing moves."""
    return bench.monitor.send_command(StopCommand())


@router.post("/abort")
def abort_bench(bench: AddressedBench) -> AgentStatus:
    """Stop coil and actuator at once by the path of a trip; it latches until a reset, also if nothing moves."""
    return bench.monitor.send_command(AbortCommand())


@router.post("/prepare", dependencies=[IDEMPOTENT])
def start_setup_step(bench: AddressedBench, request: SetupRequest) -> AgentStatus:
    """Start a setup step; it continues if the returned state is `preparing`."""
    return bench.monitor.send_command(PrepareCommand(step=request.step, position_m=request.position_m))

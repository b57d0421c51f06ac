"""Route that lists the benches with their states."""

from typing import Literal

from fastapi import APIRouter
from pydantic import Field

from bench.agent_protocol import AgentStatus
from bench.service.benches import ServedBench
from bench.service.context import Context
from bench.service.views import View


class BenchSummary(View):
    """Bench in the list of all benches."""

    name: str
    state: Literal["unknown", "idle", "preparing", "running", "stopping", "tripped"] = Field(
        description="state of the rig agent; unknown while it does not answer"
    )
    description: str = Field(description="the same as a sentence for a person")
    run: str | None = Field(description="id of the run in progress; null without one")
    drive_kind: str = Field(description="coil_v or coil_a; empty while the agent does not answer")


class BenchList(View):
    """All benches of the service."""

    items: tuple[BenchSummary, ...]


router = APIRouter(tags=["bench"])


@router.get("/benches")
def list_benches(context: Context) -> BenchList:
    """List the benches with their states; an agent that does not answer delays nothing."""
    return BenchList(items=tuple(_summarise(bench) for bench in context.benches))


def _summarise(bench: ServedBench) -> BenchSummary:
    status = bench.monitor.latest_status
    if status is None:
        absent = "its rig agent does not answer; GET /benches/NAME says why"
        return BenchSummary(name=bench.name, state="unknown", description=absent, run=None, drive_kind="")
    run = status.run.id if status.run is not None and status.run.outcome is None else None
    return BenchSummary(
        name=bench.name, state=status.state, description=_describe(status), run=run, drive_kind=status.drive_kind
    )


def _describe(status: AgentStatus) -> str:
    if status.state == "tripped":
        return f"tripped: {status.trip}"
    if status.run is not None and status.run.outcome is None:
        return f"{status.state}: {status.run.method} on {status.run.specimen or 'an unnamed specimen'}"
    if status.step is not None and status.step.outcome == "running":
        return f"{status.state}: {status.step.step}"
    return status.state

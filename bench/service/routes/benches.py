"""Routes of the benches: their list, and the parts of each; those of an only bench are also below `/bench`."""

from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Path
from pydantic import Field

from bench.agent_protocol import AgentStatus
from bench.service.benches import ServedBench
from bench.service.context import Context
from bench.service.routes import bench_control
from bench.service.routes.planning import BENCH_ROUTER
from bench.service.views import View

_PARTS = (bench_control.router, BENCH_ROUTER)


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


listing = APIRouter(tags=["bench"])


@listing.get("/benches")
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


def _name_bench(name: Annotated[str, Path(description="name of the bench", max_length=100)]) -> None:
    """Describe the name in the path; `AddressedBench` finds the bench."""


def _make_routers() -> tuple[APIRouter, APIRouter]:
    """Return the routes of the only bench, and the same ones of a named bench."""
    only, named = APIRouter(), APIRouter()
    for router in _PARTS:
        only.include_router(router, prefix="/bench")
        named.include_router(router, prefix="/benches/{name}", dependencies=[Depends(_name_bench)])
    return only, named


ROUTERS = (listing, *_make_routers())
"""All routers."""

"""Facts of a bench: limits, channels, instruments, and who holds it."""

from datetime import UTC, datetime, timedelta

from fastapi import APIRouter
from pydantic import Field

from bench.agent_protocol import AgentStatus, BenchChannel, BenchLimit, InstrumentStatus, LeaseStatus, RunStatus
from bench.service.context import AddressedBench
from bench.service.views import View

router = APIRouter(tags=["bench"])


class Lease(View):
    """Holder of the bench; a stop or an abort needs no lease."""

    holder: str | None = Field(description="`campaign`, `run` or `setup_step`; null if the bench is free")
    id: str = Field(description="id of the campaign or run, or name of the step; empty if the bench is free")
    operator: str = Field(description="person who started the run; empty if not known")
    since: datetime | None = Field(description="UTC of the start of a run; null otherwise")
    until: datetime | None = Field(description="UTC of the planned end of a run; null if not known")
    description: str = Field(description="the same as a sentence for a person")


@router.get("/limits")
def get_limits(bench: AddressedBench) -> dict[str, BenchLimit]:
    """Return the limits of the fixture by quantity; the limits of a method apply in addition."""
    return bench.monitor.describe_bench().limits


@router.get("/channels")
def get_channels(bench: AddressedBench) -> dict[str, BenchChannel]:
    """Return the recorded channels with unit, rate and delay."""
    return bench.monitor.describe_bench().channels


@router.get("/instruments")
def get_bench_instruments(bench: AddressedBench) -> tuple[InstrumentStatus, ...]:
    """Return the instruments with the state of their wires."""
    return bench.monitor.get_status().instruments


@router.get("/lease")
def get_lease(bench: AddressedBench) -> Lease:
    """Return who holds the bench: a campaign, a run, or a setup step; other starts are refused meanwhile."""
    return _make_lease(bench.monitor.get_status())


def _make_lease(status: AgentStatus) -> Lease:
    run, step = status.run, status.step
    if status.lease is not None:
        return _make_client_lease(status.lease)
    if run is not None and run.outcome is None:
        return _make_run_lease(run)
    if step is not None and step.outcome == "running":
        text = f"the setup step {step.step} is in progress"
        return Lease(holder="setup_step", id=step.step, operator="", since=None, until=None, description=text)
    free = "the bench is free" if status.state == "idle" else f"nobody holds the bench; it is {status.state}"
    return Lease(holder=None, id="", operator="", since=None, until=None, description=free)


def _make_client_lease(lease: LeaseStatus) -> Lease:
    """Return the lease of a campaign or of another client, which also holds the bench between its runs."""
    holder, _, name = lease.holder.partition(":")
    text = f"{lease.description} holds the bench; pause or stop it to use the bench"
    return Lease(holder=holder, id=name, operator="", since=None, until=None, description=text)


def _make_run_lease(run: RunStatus) -> Lease:
    since = datetime.fromisoformat(run.started)
    until = datetime.now(UTC) + timedelta(seconds=max(run.duration_s - run.elapsed_s, 0.0))
    by = f" of {run.operator}" if run.operator else ""
    text = f"run {run.id}{by} is in progress for about {max(run.duration_s - run.elapsed_s, 0.0):.0f} s more"
    return Lease(holder="run", id=run.id, operator=run.operator, since=since, until=until, description=text)

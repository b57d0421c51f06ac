"""Route of the health of the service, each part in words: agent, worker, disk, queue, clocks and others."""

import asyncio
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from importlib.metadata import version
from itertools import starmap
from typing import Any

from fastapi import APIRouter

from bench.agent_protocol import AgentStatus
from bench.catalogue import CatalogueUnavailableError
from bench.config import get_bench_name, is_executor
from bench.errors import BenchError
from bench.service.benches import ServedBench, ServedBenches
from bench.service.context import Context, ServiceContext
from bench.service.routes.planning import describe_calibration
from bench.service.views import Health

router = APIRouter(tags=["service"])
MAX_CLOCK_ERROR = 1e-3
"""[s] Bound of a clock's error above which it is reported: one sample at 1 kHz."""
_MILLISECONDS = 1e3


@router.get("/health")
async def get_health(context: Context) -> Health:
    """Return the state of each part of the bench in words; needs no sign-in."""
    worker, parts = await asyncio.gather(
        context.engine.describe_state(), asyncio.to_thread(_describe_parts, context)
    )
    return Health(version=_read_version(), worker=worker, **parts)


@cache
def _read_version() -> str:
    return version("mrbench")  # reads files


def _describe_parts(context: ServiceContext) -> dict[str, Any]:
    agents = _describe_agents(context.benches)
    return {
        "agent": _join(agents),
        "benches": agents,
        "disk": context.space_monitor.describe() or "ok",
        "queue": _describe_from_catalogue(_describe_queue, context),
        "campaigns": _describe_from_catalogue(_describe_campaigns, context),
        "audit": context.audit.describe_state(),
        "clocks": _join({name: describe_clocks(one) for name, one in context.benches.find_statuses().items()}),
        "log_store": "not used" if context.log_copier is None else context.log_copier.describe_state(),
        "calibration": _describe_from_catalogue(describe_calibration, context),
    }


def _describe_from_catalogue(describe: Callable[[ServiceContext], str], context: ServiceContext) -> str:
    """Return a description, or that there is none; the cause names the server, and health is public."""
    try:
        return context.describe_catalogue(describe)
    except CatalogueUnavailableError:
        return "not known: the catalogue cannot be used at present; see the log of the service"


def _describe_agents(benches: ServedBenches) -> dict[str, str]:
    """Return the state of each agent in words; silent ones are asked at once, so that they cost one time limit."""
    if None not in benches.list_statuses():
        return {bench.name: _describe_agent(bench) for bench in benches}
    with ThreadPoolExecutor(len(benches.names), "health") as threads:
        return dict(zip(benches.names, threads.map(_describe_agent, benches), strict=True))


def _join(states: dict[str, str]) -> str:
    """Return the state of the only bench, or those of several benches that are not ``ok``, with their names."""
    if len(states) == 1:
        return next(iter(states.values()))
    return "; ".join(f"{name}: {state}" for name, state in states.items() if state != "ok") or "ok"


def _describe_agent(bench: ServedBench) -> str:
    try:
        status = bench.monitor.get_status()
    except BenchError as error:
        return str(error)
    trip = f"tripped: {status.trip}" if status.state == "tripped" else ""
    return "; ".join(filter(None, (trip, status.notice))) or "ok"


def _describe_queue(context: ServiceContext) -> str:
    counts = context.catalogue.job_queue.count_states()
    running, waiting = counts.get("running", 0), counts.get("queued", 0)
    return f"{running} running, {waiting} waiting" if running or waiting else "empty"


def _describe_campaigns(context: ServiceContext) -> str:
    """Return ``ok``, or how many campaigns stand still because this service does not have their bench."""
    benches = [one.bench for one in context.catalogue.campaigns.list_in_progress() if is_executor(one.bench)]
    waiting = Counter(bench for bench in benches if context.benches.find_by_executor(bench) is None)
    return "; ".join(starmap(_describe_waiting, sorted(waiting.items()))) or "ok"


def _describe_waiting(executor: str, count: int) -> str:
    name = get_bench_name(executor)
    return (
        f"waiting for bench {name}, which this service does not have: {count}; "
        f"start the service with --bench {name}=bench.toml, or stop the campaign"
    )


def describe_clocks(status: AgentStatus | None) -> str:
    """Return ``ok``, or the instruments whose clock is not known well enough, with the bound of its error."""
    if status is None:
        return "not known without a rig agent"
    bounds = {one.name: one.clock_error_bound_s for one in status.instruments}
    wrong = [
        f"{name} within {bound * _MILLISECONDS:.2g} ms only"
        for name, bound in bounds.items()
        if bound is not None and bound > MAX_CLOCK_ERROR
    ]
    return "; ".join(wrong) or "ok"

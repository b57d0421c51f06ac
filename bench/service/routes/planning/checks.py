"""Routes of checks: their records, and the control chart of each channel."""

from typing import Annotated

from fastapi import APIRouter, Query, Request
from pydantic import Field

from bench.checks import CHECK_METHODS, CheckRecord, ControlChart
from bench.config import ChannelName
from bench.errors import AgentUnreachableError
from bench.service.context import Context
from bench.service.requests import IDEMPOTENT, IdempotentRoute
from bench.service.routes.planning.certificate_views import Reason
from bench.service.routes.planning.certificates import find_author
from bench.service.views import BenchChoice, View
from bench.validation import SerialNumber

router = APIRouter(prefix="/checks", tags=["checks"], route_class=IdempotentRoute)
SpecimenName = Annotated[
    SerialNumber | None,
    Query(description="mounted damper during the checks; by default that of the latest check"),
]


class CheckList(View):
    """Records of checks, the newest first."""

    items: tuple[CheckRecord, ...]


class ChartList(View):
    """Control charts that the latest checks belong to, one for each checked channel."""

    method: str | None = Field(
        description="method of the zero check on this bench, for `POST /runs`; null if the agent does not answer"
    )
    specimen: str = Field(description="mounted damper of bench.toml; empty if it names none")
    items: tuple[ControlChart, ...]


class BaselineRequest(View):
    """Request of a new baseline."""

    reason: Reason = Field(description="reason, such as a repair, for people")
    specimen: SerialNumber | None = Field(
        default=None, description="mounted damper during the checks; by default that of the latest check"
    )


@router.get("")
def list_checks(
    context: Context,
    channel: Annotated[ChannelName | None, Query(description="only those of this channel")] = None,
    limit: Annotated[int, Query(ge=1, le=1000, description="largest number of items")] = 50,
    bench: Annotated[str | None, Query(max_length=100, description="only those of this bench")] = None,
) -> CheckList:
    """List the newest records of checks, one for each run and channel; runs in the trash have none."""
    return CheckList(items=tuple(context.catalogue.checks.list_newest(limit, channel, bench)))


@router.get("/charts")
def list_charts(context: Context, bench: BenchChoice = None) -> ChartList:
    """Return the control chart of each checked channel, for the specimen of its latest check."""
    served = context.benches.get(bench)
    items = tuple(context.catalogue.checks.make_latest_charts(served.name))
    try:
        description = served.monitor.describe_bench()
    except AgentUnreachableError:  # the charts need no agent
        return ChartList(method=None, specimen="", items=items)
    return ChartList(method=CHECK_METHODS[description.drive_kind], specimen=description.specimen, items=items)


@router.get("/{channel}/chart")
def get_chart(
    channel: ChannelName, context: Context, specimen: SpecimenName = None, bench: BenchChoice = None
) -> ControlChart:
    """Return the control chart of a channel. Checks with different specimens or benches are never compared."""
    store, name = context.catalogue.checks, context.benches.get(bench).name
    return store.make_chart(store.find_series(channel, specimen, name), name)


@router.post("/{channel}/baseline", status_code=201, dependencies=[IDEMPOTENT])
def begin_baseline(
    channel: ChannelName,
    baseline: BaselineRequest,
    context: Context,
    request: Request,
    bench: BenchChoice = None,
) -> ControlChart:
    """Let only checks from now on count in the chart of a channel; the earlier records stay in the list."""
    store, name = context.catalogue.checks, context.benches.get(bench).name
    series = store.find_series(channel, baseline.specimen, name)
    store.begin_baseline(series, find_author(request), baseline.reason, name)
    return store.make_chart(series, name)

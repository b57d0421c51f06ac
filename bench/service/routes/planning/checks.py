"""Routes of checks: their records, and the control chart of each channel."""

from typing import Annotated

from fastapi import APIRouter, Query, Request
from pydantic import Field

from bench.checks import CHECK_METHODS, CheckKind, CheckRecord, ControlChart
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
KindChoice = Annotated[
    CheckKind, Query(description="zero: mean at rest; shunt: change of the force by the shunt of the load cell")
]


class CheckList(View):
    """Records of checks, the newest first."""

    items: tuple[CheckRecord, ...]


class ChartList(View):
    """Control charts that the latest checks belong to, one for each checked channel."""

    method: str | None = Field(
        description="method of this check on this bench, for `POST /runs`; null if the agent does not answer"
    )
    specimen: str = Field(description="mounted damper of bench.toml; empty if it names none")
    items: tuple[ControlChart, ...]


class BaselineRequest(View):
    """Request of a new baseline."""

    reason: Reason = Field(description="reason, such as a repair, for people")
    specimen: SerialNumber | None = Field(
        default=None, description="mounted damper during the checks; by default that of the latest check"
    )
    check: CheckKind = Field(
        default="zero", description="zero: mean at rest; shunt: change of the force by the shunt of the load cell"
    )


@router.get("")
def list_checks(
    context: Context,
    channel: Annotated[ChannelName | None, Query(description="only those of this channel")] = None,
    limit: Annotated[int, Query(ge=1, le=1000, description="largest number of items")] = 50,
    bench: Annotated[str | None, Query(max_length=100, description="only those of this bench")] = None,
    check: KindChoice = "zero",
) -> CheckList:
    """List the newest records of one kind of check, one for each run and channel; runs in the trash have none."""
    return CheckList(items=tuple(context.catalogue.checks.list_newest(limit, channel, bench, check)))


@router.get("/charts")
def list_charts(context: Context, bench: BenchChoice = None, check: KindChoice = "zero") -> ChartList:
    """Return the control chart of each channel with checks of a kind, for the specimen of the latest of them."""
    served = context.benches.get(bench)
    items = tuple(context.catalogue.checks.make_latest_charts(served.name, check))
    try:
        description = served.monitor.describe_bench()
    except AgentUnreachableError:  # the charts need no agent
        return ChartList(method=None, specimen="", items=items)
    method = CHECK_METHODS[check][description.drive_kind]
    return ChartList(method=method, specimen=description.specimen, items=items)


@router.get("/{channel}/chart")
def get_chart(
    channel: ChannelName,
    context: Context,
    specimen: SpecimenName = None,
    bench: BenchChoice = None,
    check: KindChoice = "zero",
) -> ControlChart:
    """Return the control chart of a channel. Checks of another kind, specimen or bench are never compared."""
    store, name = context.catalogue.checks, context.benches.get(bench).name
    return store.make_chart(store.find_series(channel, specimen, name, check), name)


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
    series = store.find_series(channel, baseline.specimen, name, baseline.check)
    store.begin_baseline(series, find_author(request), baseline.reason, name)
    return store.make_chart(series, name)

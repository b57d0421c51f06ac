"""Control chart of one channel as a document, with its state in words."""

from collections.abc import Sequence
from datetime import datetime

from pydantic import Field

from bench.checks.control_chart import (
    BASELINE_POINTS,
    RUN_LENGTH,
    ChartLimits,
    ChartPoint,
    ChartState,
    Rule,
    compute_chart,
)
from bench.checks.record import CheckKind, CheckRecord
from bench.config import CHANNEL_UNITS, ChannelName
from bench.validation import FrozenModel


class CheckSeries(FrozenModel):
    """Checks that are compared with each other: those of one channel with the same specimen mounted."""

    check: CheckKind = Field(description="zero: mean at rest")
    channel: ChannelName
    specimen: str = Field(description="mounted damper; empty for checks that name none")


class ControlChart(FrozenModel):
    """Control chart of a series of checks (ISO 7870-2), in the SI unit of the channel."""

    series: CheckSeries
    unit: str = Field(description="unit of all values")
    since: datetime | None = Field(description="UTC from which checks count; null for all")
    state: ChartState = Field(
        description="of the latest check: in_control, out_of_control; not_enough: the baseline is not complete; "
        "no_limits: the checks of the baseline do not differ"
    )
    text: str = Field(description="state in words, with values")
    count: int = Field(ge=0, description="[1] number of checks")
    needed: int = Field(ge=1, description="[1] number of checks in the baseline")
    limits: ChartLimits | None = Field(description="null without a complete baseline")
    points: tuple[ChartPoint, ...] = Field(description="checks, the oldest first")


def make_chart(series: CheckSeries, records: Sequence[CheckRecord], since: datetime | None) -> ControlChart:
    """Make the chart of a series.

    Args:
        series: what is compared.
        records: its checks that count, the oldest first.
        since: UTC from which they count; None for all.
    """
    values = compute_chart(records)
    return ControlChart(
        series=series,
        unit=CHANNEL_UNITS[series.channel],
        since=since,
        state=values.state,
        text=_describe(series, values.limits, values.points, values.state),
        count=len(records),
        needed=BASELINE_POINTS,
        limits=values.limits,
        points=values.points,
    )


def _describe(
    series: CheckSeries, limits: ChartLimits | None, points: Sequence[ChartPoint], state: ChartState
) -> str:
    name = f"{series.channel}: {series.check} check"
    if not points:
        return f"{series.channel}: no {series.check} check yet"
    if state == "not_enough":
        return f"{name}: not enough checks, {len(points)} of {BASELINE_POINTS}"
    if limits is None:
        return f"{name}: no limits, because all checks of the baseline have the same value"
    latest, unit = points[-1], CHANNEL_UNITS[series.channel]
    of = f"{name} of {latest.measured:%Y-%m-%d %H:%M} UTC is"
    if latest.rules:
        reasons = " and ".join(_describe_rule(rule, latest, limits, unit) for rule in latest.rules)
        return f"{of} out of control: {reasons}"
    return (
        f"{of} in control: {latest.value:.4g} {unit}, limits {limits.lower:.4g} {unit} to "
        f"{limits.upper:.4g} {unit}{_describe_baseline(points)}"
    )


def _describe_rule(rule: Rule, point: ChartPoint, limits: ChartLimits, unit: str) -> str:
    if rule == "run_of_eight":
        side = "above" if point.value > limits.centre else "below"
        return f"{RUN_LENGTH} checks in a row are {side} the centre {limits.centre:.4g} {unit}"
    if rule == "drift" and point.ewma is not None:
        what, value, bounds = "the weighted mean ", point.ewma, (limits.ewma_lower, limits.ewma_upper)
    else:
        what, value, bounds = "", point.value, (limits.lower, limits.upper)
    above = value > bounds[1]
    return f"{what}{value:.4g} {unit} is {'above' if above else 'below'} the limit {bounds[above]:.4g} {unit}"


def _describe_baseline(points: Sequence[ChartPoint]) -> str:
    beyond = sum(bool(one.rules) for one in points if one.is_baseline)
    if not beyond:
        return ""
    return f"; {beyond} of the baseline beyond them, so find the cause and begin a new baseline"

"""Control chart of one channel as a document, with its state in words."""

from collections.abc import Callable, Sequence
from datetime import datetime
from functools import partial
from typing import NamedTuple

import numpy as np
from pydantic import Field

from bench.checks.control_chart import (
    BASELINE_POINTS,
    RUN_LENGTH,
    ChartLimits,
    ChartState,
    ChartValues,
    Rule,
    compute_chart,
)
from bench.checks.record import CheckKind
from bench.config import CHANNEL_UNITS, ChannelName
from bench.validation import FrozenModel

_DIGITS: dict[CheckKind, int] = {"zero": 4, "shunt": 6}
"""Significant digits in words: the limits of a shunt check differ from its centre by a thousandth."""


class CheckValue(NamedTuple):
    """One check as a chart needs it."""

    run: str
    measured: datetime
    """UTC."""
    value: float
    standard_uncertainty: float


class ChartPoint(FrozenModel):
    """One check in the chart, in the unit of the chart."""

    run: str = Field(description="id of the run")
    measured: datetime = Field(description="UTC")
    value: float
    standard_uncertainty: float
    is_baseline: bool = Field(description="whether it belongs to the baseline")
    ewma: float | None = Field(description="exponentially weighted mean; null in the baseline")
    rules: tuple[Rule, ...] = Field(description="rules by which the check is out of control; empty for none")


class CheckSeries(FrozenModel):
    """Checks that are compared with each other: of one kind and channel, with the same specimen mounted."""

    check: CheckKind = Field(description="zero: mean at rest; shunt: change of the force by the shunt")
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


def make_chart(series: CheckSeries, checks: Sequence[CheckValue], since: datetime | None) -> ControlChart:
    """Make the chart of a series.

    Args:
        series: what is compared.
        checks: its checks that count, the oldest first.
        since: UTC from which they count; None for all.
    """
    values = _compute(checks)
    return ControlChart(
        series=series,
        unit=CHANNEL_UNITS[series.channel],
        since=since,
        state=values.state,
        text=_describe(series, checks, values),
        count=len(checks),
        needed=BASELINE_POINTS,
        limits=values.limits,
        points=_make_points(checks, values),
    )


def describe_latest(series: CheckSeries, checks: Sequence[CheckValue]) -> tuple[ChartState, str]:
    """Return the state of the latest check of a series, and the state in words.

    Args:
        series: what is compared.
        checks: its checks that count, the oldest first.
    """
    values = _compute(checks)
    return values.state, _describe(series, checks, values)


def _compute(checks: Sequence[CheckValue]) -> ChartValues:
    return compute_chart(
        np.array([one.value for one in checks]), np.array([one.standard_uncertainty for one in checks])
    )


def _make_points(checks: Sequence[CheckValue], values: ChartValues) -> tuple[ChartPoint, ...]:
    means = [None] * (len(checks) - len(values.ewma)) + values.ewma.tolist()
    return tuple(
        ChartPoint(
            run=one.run,
            measured=one.measured,
            value=one.value,
            standard_uncertainty=one.standard_uncertainty,
            is_baseline=index < BASELINE_POINTS,
            ewma=means[index],
            rules=values.rules[index],
        )
        for index, one in enumerate(checks)
    )


def _describe(series: CheckSeries, checks: Sequence[CheckValue], values: ChartValues) -> str:
    name, limits = f"{series.channel}: {series.check} check", values.limits
    if not checks:
        return f"{series.channel}: no {series.check} check yet"
    if values.state == "not_enough":
        return f"{name}: not enough checks, {len(checks)} of {BASELINE_POINTS}"
    if limits is None:
        return f"{name}: no limits, because all checks of the baseline have the same value"
    latest, show = checks[-1], partial(_format_value, series)
    of = f"{name} of {latest.measured:%Y-%m-%d %H:%M} UTC is"
    if values.rules[-1]:
        mean = float(values.ewma[-1]) if values.ewma.size else latest.value
        reasons = (_describe_rule(rule, latest.value, mean, limits, show) for rule in values.rules[-1])
        return f"{of} out of control: {' and '.join(reasons)}"
    return (
        f"{of} in control: {show(latest.value)}, limits {show(limits.lower)} to "
        f"{show(limits.upper)}{_describe_baseline(values)}"
    )


def _format_value(series: CheckSeries, value: float) -> str:
    return f"{value:.{_DIGITS[series.check]}g} {CHANNEL_UNITS[series.channel]}"


def _describe_rule(
    rule: Rule, value: float, mean: float, limits: ChartLimits, show: Callable[[float], str]
) -> str:
    match rule:
        case "run_of_eight":
            side = "above" if value > limits.centre else "below"
            return f"{RUN_LENGTH} checks in a row are {side} the centre {show(limits.centre)}"
        case "drift":
            return f"the weighted mean {_describe_beyond(mean, limits.ewma_lower, limits.ewma_upper, show)}"
        case "beyond_limits":
            return _describe_beyond(value, limits.lower, limits.upper, show)


def _describe_beyond(value: float, lower: float, upper: float, show: Callable[[float], str]) -> str:
    side, limit = ("above", upper) if value > upper else ("below", lower)
    return f"{show(value)} is {side} the limit {show(limit)}"


def _describe_baseline(values: ChartValues) -> str:
    beyond = sum(bool(rules) for rules in values.rules[:BASELINE_POINTS])
    if not beyond:
        return ""
    return f"; {beyond} of the baseline beyond them, so find the cause and begin a new baseline"

"""Actions of `mrbench check` on the catalogue of a data folder."""

from collections.abc import Iterator
from pathlib import Path
from typing import get_args

from bench.catalogue import open_catalogue
from bench.checks import CheckKind, CheckRecord, ControlChart, compute_records
from bench.config import DEFAULT_BENCH, ChannelName
from bench.errors import BenchError
from bench.log import read_log

_MOST_CHECKS = 100
"""Largest number of listed records."""


class CheckError(BenchError):
    """A check or its chart cannot be shown."""


def list_checks(data: Path, channel: str, check: CheckKind = "zero") -> list[str]:
    """Return one line for each of the newest checks of a kind.

    Raises:
        CheckError: there is no such channel.
        CatalogueError: there is no catalogue, or it cannot be opened.
    """
    wanted = _check_channel(channel) if channel else None
    with open_catalogue(data) as catalogue:
        found = catalogue.checks.list_newest(_MOST_CHECKS, wanted, check=check)
    return [_describe_record(one) for one in found] or ["no checks"]


def describe_log(path: Path) -> list[str]:
    """Return one line for each channel of the check in a log; no catalogue is read.

    Raises:
        CheckError: the log is not that of a completed check.
        LogError: the log cannot be read.
    """
    records = compute_records(read_log(path))
    if not records:
        raise CheckError(
            f"{path} is not the log of a completed check; give one of method zero_check or shunt_check"
        )
    return [_describe_record(one) for one in records]


def describe_charts(
    data: Path, channel: str, specimen: str | None, bench: str = DEFAULT_BENCH, check: CheckKind = "zero"
) -> list[str]:
    """Return the state of all channels, one line for each; for one channel also its limits and points.

    Args:
        data: data folder.
        channel: empty for all.
        specimen: mounted damper; None for that of the latest check.
        bench: bench of the service.
        check: kind of the checks.

    Raises:
        CheckError: there is no such channel.
        CatalogueError: there is no catalogue, or it cannot be opened.
    """
    with open_catalogue(data) as catalogue:
        if not channel:
            return [chart.text for chart in catalogue.checks.make_latest_charts(bench, check)] or ["no checks"]
        series = catalogue.checks.find_series(_check_channel(channel), specimen, bench, check)
        return list(_describe_chart(catalogue.checks.make_chart(series, bench)))


def begin_baseline(
    data: Path,
    channel: str,
    specimen: str | None,
    author: str,
    reason: str,
    bench: str = DEFAULT_BENCH,
    check: CheckKind = "zero",
) -> str:
    """Let only checks from now on count in a chart, and return that in one line.

    Args:
        data: data folder.
        channel: such as force.
        specimen: mounted damper; None for that of the latest check.
        author: for the record.
        reason: for people.
        bench: bench of the service.
        check: kind of the checks.

    Raises:
        CheckError: there is no such channel.
        CatalogueError: there is no catalogue, or it cannot be opened.
    """
    with open_catalogue(data) as catalogue:
        series = catalogue.checks.find_series(_check_channel(channel), specimen, bench, check)
        catalogue.checks.begin_baseline(series, author, reason, bench)
    name = _format_name(channel, check)
    return f"{name}: only checks from now on count; the earlier ones stay in the list"


def _check_channel(name: str) -> ChannelName:
    channels: tuple[ChannelName, ...] = get_args(ChannelName)
    for channel in channels:
        if channel == name:
            return channel
    raise CheckError(f"there is no channel {name!r}; give one of {', '.join(channels)}")


def _describe_record(record: CheckRecord) -> str:
    name = _format_name(record.channel, record.check)
    return (
        f"{record.measured:%Y-%m-%d %H:%M} UTC {name}: {record.value:.6g} {record.unit} with standard "
        f"uncertainty {record.standard_uncertainty:.2g} {record.unit}, "
        f"specimen {record.specimen or 'none named'}, run {record.run}"
    )


def _format_name(channel: str, check: CheckKind) -> str:
    return channel if check == "zero" else f"{channel}, {check} check"


def _describe_chart(chart: ControlChart) -> Iterator[str]:
    yield chart.text
    if chart.limits is not None:
        limits, unit = chart.limits, chart.unit
        yield f"centre {limits.centre:.6g} {unit}, standard deviation between checks {limits.sigma:.3g} {unit}"
        yield f"limits {limits.lower:.6g} {unit} and {limits.upper:.6g} {unit}"
    for point in chart.points:
        rules = f", {', '.join(point.rules).replace('_', ' ')}" if point.rules else ""
        part = ", baseline" if point.is_baseline else ""
        yield f"{point.measured:%Y-%m-%d %H:%M} UTC {point.value:.6g} {chart.unit}{part}{rules}"

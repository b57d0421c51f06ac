"""Latest check of each channel as the agent judges it at the start of a run, and its record in the log."""

from collections.abc import Iterable, Mapping
from datetime import datetime, timedelta
from typing import Literal

import orjson
from pydantic import Field

from bench.calibration.log_record import read_entry
from bench.config import ChannelName
from bench.validation import FrozenModel


class LatestCheck(FrozenModel):
    """Latest check of one channel, with its state in the control chart."""

    channel: ChannelName
    check: Literal["zero"] = Field(description="zero: mean at rest")
    run: str = Field(description="id of the run of the check")
    measured: datetime = Field(description="UTC of the check")
    state: Literal["not_enough", "no_limits", "in_control", "out_of_control"] = Field(
        description="state in the control chart of the channel"
    )
    text: str = Field(description="state in words, with values")


def list_failed(
    checks: Iterable[LatestCheck], channels: Iterable[str], now: datetime, interval_days: float | None
) -> list[str]:
    """Return, in words, the channels whose latest check is out of control, too old or missing.

    Args:
        checks: latest check of each channel.
        channels: channels that are to be checked.
        now: UTC of the start of the run.
        interval_days: largest age of a check [days]; None for any.
    """
    latest = {str(one.channel): one for one in checks}
    texts = (_describe_failure(channel, latest.get(channel), now, interval_days) for channel in channels)
    return [text for text in texts if text]


def make_check_record(checks: Iterable[LatestCheck], failed: Iterable[str]) -> dict[str, str]:
    """Return the metadata record `checks` of a log: for each channel its latest check as JSON.

    Args:
        checks: latest check of each channel.
        failed: texts of `list_failed`; each begins with its channel.
    """
    texts = {text.split(":")[0]: text for text in failed}
    known = {str(one.channel): one.model_dump(mode="json") for one in checks}
    names = dict.fromkeys([*known, *texts])
    return {name: orjson.dumps({**known.get(name, {}), "failed": texts.get(name, "")}).decode() for name in names}


def read_failed(record: Mapping[str, str]) -> list[str]:
    """Return, in words, the channels in a metadata record `checks` whose check had failed."""
    entries = (read_entry(text) for text in record.values())
    return [str(entry["failed"]) for entry in entries if entry.get("failed")]


def _describe_failure(channel: str, check: LatestCheck | None, now: datetime, interval_days: float | None) -> str:
    if check is not None and check.state == "out_of_control":
        return check.text
    if interval_days is None:
        return ""
    if check is None:
        return f"{channel}: no zero check yet; one is due every {interval_days:g} days"
    age = (now - check.measured) / timedelta(days=1)
    if age <= interval_days:
        return ""
    return f"{channel}: the latest zero check is {age:.1f} days old; one is due every {interval_days:g} days"

"""Latest checks of each channel as the agent judges them at the start of a run, and their record in the log."""

from collections.abc import Iterable, Mapping
from datetime import datetime, timedelta
from typing import Any, Literal

import orjson
from pydantic import Field

from bench.calibration.log_record import read_entry
from bench.config import ChannelName
from bench.validation import FrozenModel


class LatestCheck(FrozenModel):
    """Latest check of one kind of one channel, with its state in the control chart."""

    channel: ChannelName
    check: Literal["zero", "shunt"] = Field(
        description="zero: mean at rest; shunt: change of the force by the shunt of the load cell"
    )
    run: str = Field(description="id of the run of the check")
    measured: datetime = Field(description="UTC of the check")
    state: Literal["not_enough", "no_limits", "in_control", "out_of_control"] = Field(
        description="state in the control chart of the channel"
    )
    text: str = Field(description="state in words, with values")


def list_failed(
    checks: Iterable[LatestCheck], channels: Iterable[str], now: datetime, interval_days: float | None
) -> list[str]:
    """Return, in words, the channels of which a latest check is out of control, too old or missing.

    Args:
        checks: latest check of each channel and kind.
        channels: channels that are to be checked.
        now: UTC of the start of the run.
        interval_days: largest age of a zero check [days]; None for any. Other checks may have any age.
    """
    latest = {(str(one.channel), one.check): one for one in checks}
    texts = []
    for channel in channels:
        texts.append(_describe_failure(channel, latest.get((channel, "zero")), now, interval_days))
        shunt = latest.get((channel, "shunt"))
        texts.append("" if shunt is None else _describe_failure(channel, shunt, now, None))
    return [text for text in texts if text]


def make_check_record(checks: Iterable[LatestCheck], failed: Iterable[str]) -> dict[str, str]:
    """Return the metadata record `checks` of a log: each latest check as JSON.

    Args:
        checks: latest check of each channel and kind.
        failed: texts of `list_failed`; each begins with its channel.

    Returns:
        JSON by channel for zero checks, and by `CHANNEL.shunt` for shunt checks.
    """
    texts = {text: text.split(":")[0] for text in failed}
    entries: dict[str, dict[str, Any]] = {}
    for one in checks:
        has_failed = one.state == "out_of_control" and texts.pop(one.text, None) is not None
        entries[_make_key(one)] = {**one.model_dump(mode="json"), "failed": one.text if has_failed else ""}
    # The rest are zero checks that are too old or missing.
    for text, channel in texts.items():
        entries[channel] = {**entries.get(channel, {}), "failed": text}
    return {name: orjson.dumps(entry).decode() for name, entry in entries.items()}


def read_failed(record: Mapping[str, str]) -> list[str]:
    """Return, in words, the channels in a metadata record `checks` whose check had failed."""
    entries = (read_entry(text) for text in record.values())
    return [str(entry["failed"]) for entry in entries if entry.get("failed")]


def _make_key(check: LatestCheck) -> str:
    return str(check.channel) if check.check == "zero" else f"{check.channel}.{check.check}"


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

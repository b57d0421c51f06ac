"""File names in the data folder for files that were named elsewhere."""

import re
from datetime import UTC, datetime

_UNSAFE = re.compile(r"[^\w.+() -]")
_MAX_LENGTH = 100


def make_safe_name(name: str) -> str:
    """Return a file name without folders, control characters and leading dots; never empty."""
    plain = _UNSAFE.sub("_", name.replace("\\", "/").rpartition("/")[2]).lstrip(".")
    stem, dot, ending = plain.partition(".")
    return f"{stem[:_MAX_LENGTH] or 'unnamed'}{dot}{ending[-_MAX_LENGTH:]}"


def make_log_name(name: str, now: datetime | None = None) -> str:
    """Return the name of a new log from that of a recording, with the time as the logs of runs have it."""
    stamp = f"{(now or datetime.now(UTC)):%Y%m%dT%H%M%S.%f}"[:-3]
    return f"{stamp}Z-{make_safe_name(name).partition('.')[0]}.mcap"

"""Cache of the columns of logs, by the SHA-256 of the log's content.

Each log has one .npz file in the user's cache folder, or in that of MRBENCH_CACHE. A damaged entry is replaced,
and an entry that cannot be written is ignored. The least recently used entries are removed first.
"""

import contextlib
import json
import os
import tempfile
import zipfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import Array, find_cache_folder

_FORMAT_VERSION = "2"
"""Version of an entry's format, part of its file name."""
_MAX_SIZE = 4 * 2**30
"""Size [bytes] of all entries together."""
_READ_ERRORS = (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile)


class RawLog(NamedTuple):
    """Columns of a log."""

    samples: dict[str, Array]
    """(N,) by field, in the log's units; NaN where a message lacks the field. `time` [s] starts at 0."""
    segments: list[dict[str, Any]]
    """Segment messages, with `time` [s] from the first sample."""
    metadata: dict[str, dict[str, str]]
    """Metadata records by name."""


def find_log_cache() -> Path:
    """Return the folder of the cache."""
    return find_cache_folder() / "logs"


def read_entry(sha256: str) -> RawLog | None:
    """Return the columns of the log with this content; None if they are not cached or damaged."""
    entry = find_log_cache() / f"{sha256}.{_FORMAT_VERSION}.npz"
    try:
        with entry.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            info = json.loads(str(arrays["info"]))
            samples = dict(zip(info["names"], arrays["columns"], strict=True))
        # Reading alone does not update this time, by which the least recently used entry is found.
        os.utime(entry)
        return RawLog(samples, info["segments"], info["metadata"])
    except _READ_ERRORS:
        return None


def write_entry(sha256: str, raw: RawLog, max_size: int = _MAX_SIZE) -> None:
    """Add the columns of a log to the cache.

    Args:
        sha256: hash of the log's content.
        raw: its columns.
        max_size: size of all entries together [bytes].
    """
    info = {"names": list(raw.samples), "segments": raw.segments, "metadata": raw.metadata}
    with contextlib.suppress(OSError):
        find_log_cache().mkdir(parents=True, exist_ok=True)
        # Written under another name and renamed: another process finds a complete entry or none.
        with tempfile.NamedTemporaryFile(dir=find_log_cache(), suffix=".part", delete=False) as file:
            np.savez(file, columns=np.stack(list(raw.samples.values())), info=np.array(json.dumps(info)))
        Path(file.name).replace(find_log_cache() / f"{sha256}.{_FORMAT_VERSION}.npz")
        _evict_entries(max_size)


def _evict_entries(max_size: int) -> None:
    """Remove the least recently used entries beyond a size, remains of interrupted writers included."""
    entries = sorted(find_log_cache().iterdir(), key=lambda entry: entry.stat().st_mtime, reverse=True)
    total = 0
    for entry in entries:
        total += entry.stat().st_size
        if total > max_size:
            entry.unlink(missing_ok=True)

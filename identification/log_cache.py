"""Keeps the columns of logs that were read before, by the SHA-256 of the log's content.

One .npz file a log in the user's cache folder; MRBENCH_CACHE names another one. What cannot be read is read
from the log again and replaced; what cannot be written is no error. The oldest entries make room for new ones.
"""

import contextlib
import json
import os
import tempfile
import zipfile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import Array, cache_folder

_FORM = "1"
"""Of an entry; another form is another name."""
_LARGEST = 4 * 2**30
"""[bytes] All entries together."""
_DAMAGED = (OSError, ValueError, KeyError, EOFError, TypeError, zipfile.BadZipFile)


class RawLog(NamedTuple):
    """The columns of a log."""

    samples: dict[str, Array]
    """(N,) by the field's name, in the log's units; NaN where a message lacks it; `time` [s] from the first."""
    segments: list[dict[str, Any]]
    """Segment messages, with `time` [s] from the first sample."""
    metadata: dict[str, dict[str, str]]
    """Metadata records by name."""


def folder() -> Path:
    """Where the cache stands."""
    return cache_folder() / "logs"


def recall(sha256: str) -> RawLog | None:
    """The columns of the log with this content; None where they are not kept or damaged."""
    entry = folder() / f"{sha256}.{_FORM}.npz"
    try:
        with entry.open("rb") as file, np.load(file, allow_pickle=False) as kept:
            said = json.loads(str(kept["said"]))
            samples = dict(zip(said["names"], kept["columns"], strict=True))
        # What was asked for last is to go last; reading alone does not touch this time.
        os.utime(entry)
        return RawLog(samples, said["segments"], said["metadata"])
    except _DAMAGED:
        return None


def keep(sha256: str, raw: RawLog, largest: int = _LARGEST) -> None:
    """Keep a log's columns.

    Args:
        sha256: of the log's content.
        raw: its columns.
        largest: size of all entries together [bytes]; the least recently used ones go first.
    """
    said = {"names": list(raw.samples), "segments": raw.segments, "metadata": raw.metadata}
    with contextlib.suppress(OSError):
        folder().mkdir(parents=True, exist_ok=True)
        # Written beside and moved into place: another process finds a whole entry or none.
        with tempfile.NamedTemporaryFile(dir=folder(), suffix=".part", delete=False) as file:
            np.savez(file, columns=np.stack(list(raw.samples.values())), said=np.array(json.dumps(said)))
        Path(file.name).replace(folder() / f"{sha256}.{_FORM}.npz")
        _make_room(largest)


def _make_room(largest: int) -> None:
    """Remove the least recently used entries beyond the size allowed; what a broken writer left is one, too."""
    entries = sorted(folder().iterdir(), key=lambda entry: entry.stat().st_mtime, reverse=True)
    total = 0
    for entry in entries:
        total += entry.stat().st_size
        if total > largest:
            entry.unlink(missing_ok=True)

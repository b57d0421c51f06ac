"""Store of the samples of recorded runs as columns, next to the logs.

A log is made to be written safely and takes long to read. Its samples are kept as columns under the hash of the
log, so that a second request takes milliseconds. The store can be deleted at any time.
"""

import json
import logging
import os
from contextlib import suppress
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from bench.errors import LogError
from bench.log import read_log, write_atomically
from bench.samples.table import SampleTable, SegmentRange, make_table

FOLDER = ".samples"
"""Folder of the store in a data folder."""
MAX_BYTES = 4 * 2**30
"""Size of the store above which the tables that were used longest ago are deleted [bytes]."""
_TIME, _INFO = "time", "info"
_LOG = logging.getLogger(__name__)


class SampleStore:
    """Samples of the logs of one data folder; safe from any thread.

    Args:
        data: the data folder.
        max_bytes: size of the store that is kept.
    """

    def __init__(self, data: Path, max_bytes: int = MAX_BYTES) -> None:
        self._folder, self._max_bytes = data / FOLDER, max_bytes

    def load(self, log: Path, sha256: str | None) -> SampleTable:
        """Return the samples of a log, and store them if it is complete.

        Args:
            log: path of the log.
            sha256: stored hash of the log; None if the log has no end.

        Raises:
            LogError: the log does not exist, is truncated or damaged, or contains no sample.
        """
        path = self._folder / f"{sha256}.npz"
        if sha256 is not None and path.is_file():
            with suppress(OSError, ValueError, KeyError, BadZipFile):  # a damaged table is made again
                return _read(path)
        table = make_table(read_log(log))
        if sha256 is not None:
            self._write(path, table)
        return table

    def _write(self, path: Path, table: SampleTable) -> None:
        """Store a table; without space the log is read again next time."""
        try:
            self._folder.mkdir(exist_ok=True)
            with write_atomically(path) as partial, partial.open("wb") as file:
                np.savez(file, **_make_arrays(table))
            self._remove_old()
        except (OSError, LogError) as error:
            _LOG.warning("samples_not_stored", extra={"path": str(path), "why": str(error)})

    def _remove_old(self) -> None:
        files = sorted(self._folder.glob("*.npz"), key=lambda file: file.stat().st_mtime_ns, reverse=True)
        size = 0
        for file in files:
            size += file.stat().st_size
            if size > self._max_bytes:
                file.unlink(missing_ok=True)


def _make_arrays(table: SampleTable) -> dict[str, Any]:
    info = {
        "units": table.units,
        "segments": [one.model_dump(mode="json") for one in table.segments],
        "drive_unit": table.drive_unit,
        "started_utc_s": table.started_utc_s,
    }
    columns = {f"column_{name}": column for name, column in table.columns.items()}
    return {_TIME: table.time, _INFO: np.array(json.dumps(info)), **columns}


def _read(path: Path) -> SampleTable:
    os.utime(path)  # the time of use decides which tables are deleted
    with np.load(path, allow_pickle=False) as file:
        info = json.loads(str(file[_INFO]))
        columns = {name: file[f"column_{name}"] for name in info["units"]}
        time = file[_TIME]
    segments = tuple(SegmentRange.model_validate(one) for one in info["segments"])
    return SampleTable(time, columns, info["units"], segments, info["drive_unit"], info["started_utc_s"])

"""Small logs of runs, whole and cut off."""

from datetime import UTC, datetime

import numpy as np

from bench.recorder.header import RunHeader
from bench.recorder.mcap_file import MAGIC
from bench.recorder.writer import LogWriter

STARTED = datetime(2026, 3, 1, 10, 0, tzinfo=UTC)


def whole_log(path, run="run-1", outcome="clean", source="run", first_s=0.0, started=STARTED):
    """Two seconds of a sine; the first sample `first_s` after the bench clock's zero [s]."""
    time = np.arange(1000) / 500.0
    header = RunHeader(
        id=run,
        specimen="damper 7",
        method="quick",
        drive_kind="coil_v",
        drive_unit="V",
        source=source,
        operator="M. Curie",
        utc_offset=started.isoformat() if started else "",
    )
    with LogWriter(path, header) as log:
        columns = {
            "displacement": 0.01 * np.sin(2 * np.pi * time),
            "velocity": 0.01 * 2 * np.pi * np.cos(2 * np.pi * time),
            "force": 50 * np.cos(2 * np.pi * time),
            "coil_drive": np.full(1000, 0.2),
        }
        log.samples(np.round((first_s + time) * 1e9).astype(np.int64), columns)
        log.close(outcome, "" if outcome == "clean" else "said so")
    return path


def cut_off_log(path, run="run-1"):
    """The same without its last third, as a kill leaves it."""
    whole = whole_log(path, run).read_bytes()
    path.write_bytes(whole[: len(whole) * 2 // 3])
    assert not path.read_bytes().endswith(MAGIC)
    return path

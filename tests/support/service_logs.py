"""Small logs of runs, complete and truncated."""

from datetime import UTC, datetime

import numpy as np

from bench.log.header import RunHeader
from bench.log.mcap_file import MAGIC
from bench.log.writer import LogWriter
from bench.methods import load_method

STARTED = datetime(2026, 3, 1, 10, 0, tzinfo=UTC)


def write_complete_log(
    path,
    run="run-1",
    outcome="clean",
    source="run",
    first_s=0.0,
    started=STARTED,
    ending=None,
    method=None,
    checkpoint="",
    calibration=None,
):
    """Write two seconds of a sine; the first sample is at `first_s` [s] of the bench clock."""
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
        calibration=calibration or {},
    )
    with LogWriter(path, header) as log:
        columns = {
            "displacement": 0.01 * np.sin(2 * np.pi * time),
            "velocity": 0.01 * 2 * np.pi * np.cos(2 * np.pi * time),
            "force": 50 * np.cos(2 * np.pi * time),
            "coil_drive": np.full(1000, 0.2),
        }
        log.write_samples(np.round((first_s + time) * 1e9).astype(np.int64), columns)
        if method:
            log.attach("method.json", "application/json", load_method(method).to_json().encode())
        if checkpoint:
            log.write_event(2_000_000_000, "checkpoint", f"after segment {checkpoint}")
        log.close(outcome, "" if outcome == "clean" else "stopped by the test", ending)
    return path


def write_truncated_log(path, run="run-1"):
    """Write the same log without its last third, as after a kill of the recorder."""
    complete = write_complete_log(path, run).read_bytes()
    path.write_bytes(complete[: len(complete) * 2 // 3])
    assert not path.read_bytes().endswith(MAGIC)
    return path


def write_empty_log(path, run="run-1"):
    """Write the beginning of the same log, as after a kill of the recorder before its first sample."""
    path.write_bytes(write_complete_log(path, run).read_bytes()[:2000])
    return path

"""Process that executes a run as the agent does, and kills itself after a number of samples.

python -m tests.support.agent_killed_during_run FOLDER SAMPLES [synced]

The kill is an item of the recorder's queue, so all samples were passed to the log's writer before. Without a sync,
the samples of the open chunk are lost: at most `CHUNK_TIME` of bench time, however fast the machine is.
"""

import os
import signal
import sys
import threading
from pathlib import Path

import numpy as np

from bench.agent.ownership import acquire_agent_lock
from drivers.channel import Frame
from tests.support.logs import times, values
from tests.support.run_bench import RunBench

BATCH = 20
"""Samples that are recorded together."""
FIRST_IN_SEGMENT = 100
"""First sample of the segment, which has not ended when the process is killed."""


def record_and_die(bench, count, is_synced):
    """Record samples, a segment mark, an event and frames, then kill this process."""
    log, time_ns = bench.run.log, times(count)
    columns = values(count, segment=np.where(np.arange(count) < FIRST_IN_SEGMENT, -1, 0))
    mark = {"index": 0, "name": "a", "stretch": "test_method", "motion": "sine", "drive": "constant"}
    for start in range(0, count, BATCH):
        if start == FIRST_IN_SEGMENT:
            log.write_segment(int(time_ns[start]), phase="start", **mark)
            log.write_event(int(time_ns[start]), "state", "first stroke")
        rows = slice(start, start + BATCH)
        log.write_samples(time_ns[rows], {name: column[rows] for name, column in columns.items()})
        log.write_frame("cell", Frame(int(time_ns[start]), False, b"frame"))
    if is_synced:
        log._enqueue(lambda writer: writer._file.sync())
    log._enqueue(lambda writer: os.kill(os.getpid(), signal.SIGKILL))
    threading.Event().wait()


if __name__ == "__main__":
    folder, count, is_synced = Path(sys.argv[1]), int(sys.argv[2]), "synced" in sys.argv
    bench = RunBench(folder, lambda: 0)
    with acquire_agent_lock(bench.toml):
        bench.executor.execute(
            bench.prepare(lambda supervision: record_and_die(bench, count, is_synced), folder / "run.mcap")
        )

"""Recorder that writes samples at 1 kHz in real time until it is killed, and prints the time [ns] of each.

python record_in_real_time.py LOG
"""

import os
import sys
import time

from bench.log.header import RunHeader
from bench.log.writer import LogWriter

header = RunHeader(
    id="endless", specimen="damper 7", method="endless", drive_kind="coil_v", drive_unit="V", source="run"
)
with LogWriter(sys.argv[1], header) as log:
    log.write_segment(
        0, phase="start", index=0, name="endless", stretch="endless", motion="hold", drive="constant"
    )
    start = time.monotonic_ns()
    while True:
        now = time.monotonic_ns() - start
        values = {"displacement": 0.01, "velocity": 0.0, "force": now * 1e-9, "coil_drive": 0.2, "segment": 0}
        log.write_sample(now, values)
        os.write(1, f"{now}\n".encode())
        time.sleep(0.001)

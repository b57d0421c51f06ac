"""Speed of writing a log and of reading it into arrays, at first from its messages and later from the cache."""

import os
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bench.log import LogWriter, RunHeader
from benchmarks.common import measure_cpu_time, print_line
from identification.logs import load

SAMPLE_COUNT = 400_000


def run() -> None:
    """Print the written and read samples per second."""
    random = np.random.default_rng(1)
    t = np.arange(SAMPLE_COUNT) / 1000
    columns = {
        "displacement": 0.01 * np.sin(2 * np.pi * t) + 2e-6 * random.standard_normal(SAMPLE_COUNT),
        "velocity": 0.0628 * np.cos(2 * np.pi * t),
        "force": 400 * np.cos(2 * np.pi * t) + 2.5 * random.standard_normal(SAMPLE_COUNT),
        "coil_drive": np.full(SAMPLE_COUNT, 0.3),
        "coil_voltage": 0.3 + 1e-3 * random.standard_normal(SAMPLE_COUNT),
    }
    with TemporaryDirectory() as folder:
        # With a filled cache the first reading would not parse the messages.
        os.environ["MRBENCH_CACHE"] = str(Path(folder) / "cache")
        log = Path(folder) / "run.mcap"
        began = time.process_time()
        with LogWriter(log, make_header()) as writer:
            writer.write_samples(np.arange(SAMPLE_COUNT) * 1_000_000, columns)
        written = time.process_time() - began
        first = measure_cpu_time(lambda: load(log), 1)
        later = measure_cpu_time(lambda: load(log), 5)
    print(f"log: {SAMPLE_COUNT} samples of five channels, one JSON message each")
    print_line("written", SAMPLE_COUNT / written, "1/s", "")
    print_line("read into arrays for the first time", SAMPLE_COUNT / first, "1/s", "at least 80 000")
    print_line("read into arrays from the cache", SAMPLE_COUNT / later, "1/s", "at least 1 000 000")


def make_header() -> RunHeader:
    """Return a header with the required fields of a log."""
    return RunHeader(
        id="benchmark", specimen="none", method="none", drive_kind="coil_v", drive_unit="V", source="run",
        versions={}, utc_offset="", velocity_from="smoothed displacement",
    )  # fmt: skip

"""Log into arrays: the first read parses every message, later ones take the cache."""

import os
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bench.recorder.header import RunHeader
from bench.recorder.writer import LogWriter
from benchmarks.timing import cpu_seconds, line
from identification.recordings import load

SAMPLES = 400_000


def run() -> None:
    """Print samples a second, written and read."""
    random = np.random.default_rng(1)
    t = np.arange(SAMPLES) / 1000
    columns = {
        "displacement": 0.01 * np.sin(2 * np.pi * t) + 2e-6 * random.standard_normal(SAMPLES),
        "velocity": 0.0628 * np.cos(2 * np.pi * t),
        "force": 400 * np.cos(2 * np.pi * t) + 2.5 * random.standard_normal(SAMPLES),
        "coil_drive": np.full(SAMPLES, 0.3),
        "coil_voltage": 0.3 + 1e-3 * random.standard_normal(SAMPLES),
    }
    with TemporaryDirectory() as folder:
        # An empty cache, or the first reading would be a later one.
        os.environ["MRBENCH_CACHE"] = str(Path(folder) / "cache")
        log = Path(folder) / "run.mcap"
        began = time.process_time()
        with LogWriter(log, header()) as writer:
            writer.samples(np.arange(SAMPLES) * 1_000_000, columns)
        written = time.process_time() - began
        first = cpu_seconds(lambda: load(log), 1)
        later = cpu_seconds(lambda: load(log), 5)
    print(f"log: {SAMPLES} samples of five channels, one JSON message each")
    line("written", SAMPLES / written, "1/s", "")
    line("read into arrays for the first time", SAMPLES / first, "1/s", "at least 80 000")
    line("read into arrays from the second time on", SAMPLES / later, "1/s", "at least 1 000 000")


def header() -> RunHeader:
    """A header with the least that a log needs."""
    return RunHeader(
        id="benchmark", specimen="none", method="none", drive_kind="coil_v", drive_unit="V", source="run",
        versions={}, utc_offset="", velocity_from="smoothed displacement",
    )  # fmt: skip

"""Small logs and CSV recordings for several tests."""

import os
from pathlib import Path

import numpy as np
import pytest

from bench.log.header import ChannelInfo, RunHeader
from bench.log.writer import LogWriter

RATE = 500.0
MILLISECOND = 1_000_000


def header(**changes):
    fields = {
        "id": "run-1",
        "specimen": "damper 7",
        "method": "quick",
        "drive_kind": "coil_v",
        "drive_unit": "V",
        "source": "run",
        "seed": 3,
        "versions": {"mrbench": "0.1.0"},
        "channels": {"force": ChannelInfo(unit="N", rate_hz=1000.0, delay_s=0.001)},
    }
    return RunHeader(**{**fields, **changes})


def values(samples, **more):
    time = np.arange(samples) / RATE
    stroke = 0.01 * np.sin(2 * np.pi * time)
    speed = 0.01 * 2 * np.pi * np.cos(2 * np.pi * time)
    return {
        "displacement": stroke,
        "velocity": speed,
        "force": 800 * speed + 45 * np.tanh(100 * speed),
        "coil_drive": np.full(samples, 0.2),
        **more,
    }


def times(samples, first=0):
    return first + np.arange(samples, dtype=np.int64) * 2 * MILLISECOND


def write_log(path, samples=1500, **changes):
    """Write a log with one segment from sample 100 to 999, an event and an attachment."""
    segment = np.where((np.arange(samples) >= 100) & (np.arange(samples) < 1000), 0, -1)
    time_ns, columns = times(samples), values(samples, segment=segment)
    mark = {"index": 0, "name": "10mm_1Hz_0.2V", "stretch": "quick", "motion": "sine", "drive": "constant"}
    numbers = {"amplitude": 0.01, "frequency": 1.0, "drive_value": 0.2}
    with LogWriter(path, header(**changes)) as log:
        log.attach("method.json", "application/json", b"{}")
        for part in (slice(0, 100), slice(100, 1000), slice(1000, None)):
            if part.start == 100:
                log.write_segment(int(time_ns[100]), phase="start", **mark, **numbers)
            if part.start == 1000:
                log.write_segment(int(time_ns[999]), phase="end", **mark, **numbers)
            log.write_samples(time_ns[part], {name: column[part] for name, column in columns.items()})
        log.write_event(int(time_ns[-1]), "state", "run finished", reason="plan")
    return columns


def shared_folder():
    """Return the folder with recordings of real dampers, or skip the test."""
    folder = os.environ.get("MRBENCH_SHARED")
    if not folder or not (Path(folder) / "data").is_dir():
        pytest.skip("recordings of real dampers: MRBENCH_SHARED is not a folder with data/")
    return Path(folder)


def csv_columns(samples=1000, noise=0.0, seed=1):
    """Return columns of a sine of 10 mm and 1 Hz at 0.2 V, then at 0.4 V."""
    generator = np.random.default_rng(seed)
    time = np.arange(samples) / RATE
    stroke = 0.01 * np.sin(2 * np.pi * time) + generator.normal(0, 3e-6, samples)
    drive = np.where(np.arange(samples) < samples // 2, 0.2, 0.4)
    force = 700 * np.gradient(stroke, 1 / RATE) + generator.normal(0, noise, samples)
    return {"time_s": time, "displacement_m": stroke, "voltage_v": drive, "force_n": force}


def write_csv(path, columns):
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def write_spoilt_csv(path, line, column, text, samples=1000):
    """Write a recording in which one cell of one line is replaced."""
    write_csv(path, csv_columns(samples))
    lines = path.read_text().splitlines()
    index = lines[0].split(",").index(column)
    cells = lines[line - 1].split(",")
    lines[line - 1] = ",".join([*cells[:index], text, *cells[index + 1 :]])
    path.write_text("\n".join(lines) + "\n")
    return path

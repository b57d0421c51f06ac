"""Small log and series for the tests of reports."""

import numpy as np

from bench.log.header import ChannelInfo, RunHeader
from bench.log.writer import LogWriter
from bench.report.documents import Prediction
from bench.report.series import ForceSeries

RATE = 500.0
DRIVES = (0.1, 0.3)
CYCLES = 4
"""Cycles of each part: a sine of 10 mm and 2 Hz at each drive, then one with a varying drive."""


def columns():
    time = np.arange(int(3 * CYCLES / 2 * RATE)) / RATE
    part = len(time) // 3
    varying = np.where(time[2 * part :] % 0.5 < 0.25, 0.1, 0.3)
    drive = np.concatenate([np.full(part, DRIVES[0]), np.full(part, DRIVES[1]), varying])
    speed = 0.01 * 4 * np.pi * np.cos(4 * np.pi * time)
    return {
        "time": time,
        "displacement": 0.01 * np.sin(4 * np.pi * time),
        "velocity": speed,
        "force": 700 * speed + (45 + 900 * drive) * np.tanh(100 * speed),
        "drive": drive,
    }


def write_log(path, outcome="clean", specimen="damper 7", calibration=None, checks=None):
    found = columns()
    time_ns = np.round(found["time"] * 1e9).astype(np.int64)
    header = RunHeader(
        id="run-1",
        specimen=specimen,
        method="strokes",
        drive_kind="coil_v",
        drive_unit="V",
        source="run",
        utc_offset="2026-05-04T03:02:01+00:00",
        versions={"mrbench": "0.1.0"},
        calibration=calibration or {},
        checks=checks or {},
        channels={"force": ChannelInfo(unit="N", rate_hz=1000.0, delay_s=0.001)},
    )
    samples = {name: found[name] for name in ("displacement", "velocity", "force")} | {
        "coil_drive": found["drive"]
    }
    part = len(time_ns) // 3
    with LogWriter(path, header) as log:
        for index, drive in enumerate((*DRIVES, None)):
            rows = slice(index * part, (index + 1) * part)
            mark = {"index": index, "name": f"part {index}", "stretch": "strokes", "motion": "sine"}
            mark |= {"amplitude": 0.01, "frequency": 2.0, "drive_value": drive}
            mark["drive"] = "steps" if drive is None else "constant"
            log.write_segment(int(time_ns[rows][0]), phase="start", **mark)
            log.write_samples(time_ns[rows], {name: column[rows] for name, column in samples.items()})
            log.write_segment(int(time_ns[rows][-1]), phase="end", **mark)
        if outcome != "clean":
            log.count_lost("force", 3)
    return path


def series(error=2.0, held_out=False):
    found = columns()
    wiggle = error * np.sqrt(2) * np.sin(2 * np.pi * 31 * found["time"])
    held = np.zeros(len(found["time"]), bool)
    if held_out:
        held[len(held) // 2 :] = True
    arrays = {**found, "simulated": found["force"] + wiggle, "held_out": held}
    return ForceSeries({**arrays, "stretch": np.zeros(len(held), np.int64)})


def prediction(rmse=2.0, floor=1.9, before_n=None):
    drives = [
        {"drive": 0.10003, "unit": "V", "rmse_n": rmse, "nrmse": 0.021, "samples": 1500},
        {"drive": 0.29998, "unit": "V", "rmse_n": 1.1 * rmse, "nrmse": 0.012, "samples": 1500},
    ]
    return Prediction.model_validate(
        {
            "schema": "mrbench.prediction/1",
            "rmse_n": rmse,
            "nrmse": 0.0162,
            "bias_n": -0.234,
            "noise_floor_n": floor,
            "per_drive": drives,
            "samples": 3000,
            "freed": ["y0 of each stretch"],
            "before_n": before_n,
        }
    )

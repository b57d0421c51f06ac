"""Logs of sines at several drives, whose cycles are known exactly."""

import numpy as np

from bench.log.writer import LogWriter
from tests.support.logs import header

RATE = 500.0
CYCLES = 4
FRICTION, DAMPING = 60.0, 800.0
"""Force at the drive 0.1 V [N] and per speed [N s/m]."""


def write_cyclic_log(
    path, run="run-1", drives=(0.1, 0.3), amplitude=0.01, frequency=2.0, gain=1.0, preload=0.0, temperature=None,
    shift=0.0, name="{drive:g}V",
):  # fmt: skip
    """Write one segment of whole cycles for each drive, which begins at a phase of ``shift`` cycles."""
    count = round(CYCLES / frequency * RATE)
    with LogWriter(path, header(id=run, utc_offset="2026-03-01T10:00:00+00:00")) as log:
        for index, drive in enumerate(drives):
            columns = make_columns(count, amplitude, frequency, drive, gain, preload, shift)
            columns["segment"] = np.full(count, index)
            if temperature is not None:
                columns["temperature"] = np.full(count, float(temperature))
            time_ns = ((index * count + np.arange(count)) * 1e9 / RATE).astype(np.int64)
            mark = {"index": index, "name": name.format(drive=drive), "stretch": "quick", "motion": "sine"}
            mark |= {"drive": "constant", "amplitude": amplitude, "frequency": frequency, "drive_value": drive}
            log.write_segment(int(time_ns[0]), phase="start", **mark)
            log.write_samples(time_ns, columns)
            log.write_segment(int(time_ns[-1]), phase="end", **mark)
    return path


def make_columns(count, amplitude, frequency, drive, gain, preload, shift):
    angle = 2 * np.pi * (frequency * np.arange(count) / RATE + shift)
    speed = amplitude * 2 * np.pi * frequency * np.cos(angle)
    force = gain * (10 * drive * FRICTION * np.tanh(speed / 0.01) + DAMPING * speed) + preload
    return {
        "displacement": amplitude * np.sin(angle), "velocity": speed, "force": force,
        "coil_drive": np.full(count, drive),
    }  # fmt: skip

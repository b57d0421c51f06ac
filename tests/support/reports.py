"""Small log, fit and series for the tests of reports."""

import json

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


def estimate(value, unit, ci95=None, identifiable=True, note="known to 1 %"):
    return {"value": value, "unit": unit, "ci95": ci95, "identifiable": identifiable, "note": note}


def fit_document(sha256="", **changes):
    delay = {"value": 4.2e-6, "unit": "s", "ci95": [-1e-5, 1.84e-5], "prior_sd": 2e-5, "outside_prior": False}
    document = {
        "schema": "mrbench.fit/1",
        "specimen": "damper 7",
        "drive_kind": "coil_v",
        "drive_unit": "V",
        "drive_range": [0.1, 0.3],
        "parameters": {
            "alpha_a": estimate(5097.3, "N/m", [5062.2, 5132.7]),
            "A": estimate(301.0, "1", None, identifiable=False, note="a gauge"),
            "c0_b": estimate(2196.5, "N s/(m V)", [-900.0, 5300.0], identifiable=False, note="hardly seen"),
        },
        "coordinates": {
            "F_a": estimate(44.862, "N", [44.766, 44.959]),
            "D_y": estimate(2.924e-5, "m", [2.904e-5, 2.944e-5]),
        },
        "nuisances": {"y0": {"strokes": -3.8e-6}, "force_delay": delay, "drive_delay": delay},
        "noise_floor_n": 1.9,
        "floor": {"cycle_to_cycle": 1.91, "high_frequency": 1.89, "basis": "cycle to cycle over 6 cycles"},
        "rmse_n": {"train": 1.98, "validation": None, "held_out": 2.04},
        "nrmse": {"train": 0.016, "validation": None, "held_out": 0.017},
        "per_drive": [],
        "stages": [{"name": "refine", "seconds": 0.6, "rmse_n": 1.98, "iterations": 7, "note": ""}],
        "agreement": None,
        "result": "converged",
        "correlations": {"k0,k1": -0.9392},
        "provenance": {
            "logs": {"strokes.mcap": sha256},
            "version": "0.1.0",
            "seed": 1,
            "settings": {"stages": "refine", "hold_out": None},
        },
    }
    return {**document, **changes}


def write_fit(path, sha256="", **changes):
    path.write_text(json.dumps(fit_document(sha256, **changes)))
    return path


STAGES = ("coil", "damper", "mounting", "force_channel", "displacement_channel")


def diagnosis_document(**changes):
    """A diagnosis that names a late force, as `mrbench diagnose` writes it."""
    late = {
        "name": "force_delay", "stage": "force_channel", "form": "pure_delay",
        "parameters": {"delay": {"value": 0.0041, "unit": "s", "ci95": [0.004, 0.0042]}},
        "share": 1.0, "probability": 0.91, "note": "",
    }  # fmt: skip
    place = {"drive": 0.5, "amplitude_m": 0.01, "frequency_hz": 2.0, "phase": 0.3125, "gap_n": 12.0}
    found = {
        "schema": "mrbench.diagnosis/1", "verdict": "explained", "effects": [late],
        "alternatives": [{"effects": ["coil_lag", "gas_spring"], "probability": 0.05}],
        "probability": 0.9, "unknown_probability": 0.04,
        "gap": {
            "before_n": 13.2, "after_n": 2.6, "noise_floor_n": 2.5, "shrinkage": 0.97,
            "shrinkage_ci95": [0.95, 0.99], "nominal_n": 31.0, "train_before_n": 13.0, "train_after_n": 2.5,
        },
        "where": {
            "stage": "force_channel", "stages": dict.fromkeys(STAGES, 0.01) | {"force_channel": 0.96},
            "map": [place, place | {"drive": 0.0, "phase": 0.0625, "gap_n": 3.0}], "harmonics": [],
            "drift": {}, "explainable": 0.9,
        },
        "next_stroke": {
            "segment": {
                "name": "next", "motion": {"kind": "sine", "amplitude_m": 0.0036, "frequency_hz": 7.86},
                "drive": {"kind": "constant", "value": 1.5},
            },
            "separates": [["force_delay"], ["coil_lag", "gas_spring"]], "expected_n": 2.0, "detectability": 40.0,
        },
        "explanation": "The force lags by 4.1 ms; check the load cell's filter.",
        "notes": ["a gain is visible to calibration only"],
    }  # fmt: skip
    return found | changes


def discovery_document(**changes):
    """Return a cause outside the library: a friction that grows with the square of the displacement."""
    curve = {
        "variable": "displacement", "unit": "N", "x": [-0.01, 0.0, 0.01], "value": [4.0, 0.0, 4.0],
        "lo": [3.0, -1.0, 3.0], "hi": [5.0, 1.0, 5.0],
    }  # fmt: skip
    found = {
        "stage": "damper", "place": "parallel_force", "variables": ["displacement", "velocity"], "curve": curve,
        "rmse_n": 3.1, "log_odds": 40.0, "replaces": ["force_delay"],
        "formula": {
            "expression": "sign(velocity)*(a*displacement**2)",
            "symbols": {"a": {"value": 40000.0, "unit": "N/m^2", "ci95": [39000.0, 41000.0]}},
        },
        "definition": {}, "shrinkage": 0.92, "shrinkage_ci95": [0.88, 0.95],
        "further": [{
            "stage": "mounting", "place": "mounting", "variables": ["acceleration"],
            "curve": curve | {"variable": "acceleration", "lo": None, "hi": None}, "rmse_n": 2.8, "log_odds": 9.0,
        }],
    }  # fmt: skip
    return found | changes

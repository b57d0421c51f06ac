"""Whole path on the simulated rig: record, identify, predict strokes that no fit has read."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

COMMAND = Path(sys.executable).parent / "mrbench"
SEED, VALIDATION_SEED = 7, 1007
"""The validation strokes have their own noise, clock errors and zero of the load cell."""
LABORATORY = {
    "F_a": 45.0,
    "F_b": 900.0,
    "D_y": 30e-6,
    "rho": 0.55,
    "n": 2.0,
    "eta": 80.0,
    "c0_a": 700.0,
    "c0_b": 2200.0,
    "c1_a": 18e3,
    "c1_b": 26e3,
    "k0": 2200.0,
    "k1": 800.0,
}
"""True coordinates of scenario ``default``, except f0: the zero of the load cell differs between runs."""


def mrbench(*words):
    done = subprocess.run([COMMAND, *map(str, words)], capture_output=True, text=True, timeout=250)
    assert done.returncode == 0, done.stderr


@pytest.fixture(scope="module")
def documents(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rig")
    fit, prediction = folder / "fit.json", folder / "prediction.json"
    mrbench("run", "quick", "--scenario", "default", "--seed", SEED, "--out", folder / "quick.mcap")
    mrbench(
        "run",
        "validation",
        "--scenario",
        "default",
        "--seed",
        VALIDATION_SEED,
        "--out",
        folder / "validation.mcap",
    )
    mrbench("identify", folder / "quick.mcap", "--out", fit)
    mrbench("predict", fit, folder / "validation.mcap", "--free", "offset", "--out", prediction)
    return json.loads(fit.read_text()), json.loads(prediction.read_text())


def test_a_fit_of_half_a_minute_reaches_the_noise_floor(documents):
    fit, _ = documents
    assert fit["result"] == "converged"
    assert fit["rmse_n"]["train"] <= 1.05 * fit["noise_floor_n"]


def test_validation_strokes_are_predicted_to_the_noise_floor(documents):
    _, prediction = documents
    assert prediction["freed"] == ["y0 of each stretch", "force offset of each stretch"]
    assert prediction["rmse_n"] <= 1.05 * prediction["noise_floor_n"]


def test_the_true_coordinates_are_inside_the_intervals(documents):
    fit, _ = documents
    intervals = {name: fit["coordinates"][name]["ci99"] for name in LABORATORY}
    inside = [name for name, (low, high) in intervals.items() if low <= LABORATORY[name] <= high]
    assert len(inside) >= 11

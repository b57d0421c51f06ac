"""Recordings of real dampers, where they are at hand: the plain law on strokes that the fit never saw."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from identification.fitting.dataset import HoldOut
from identification.logs.recording import load
from identification.pipeline import FitRequest, identify

COMMAND = Path(sys.executable).parent / "mrbench"
SHARED = os.environ.get("MRBENCH_SHARED")
DATA = Path(SHARED or "").resolve() / "data"

pytestmark = pytest.mark.skipif(
    SHARED is None or not (DATA / "utfsm_sine").is_dir(),
    reason="no recordings of real dampers: MRBENCH_SHARED names no folder with data/utfsm_sine",
)


def imported(files, log):
    done = subprocess.run([COMMAND, "import", *files, "--out", log], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return load(log)


@pytest.fixture(scope="session")
def sines(tmp_path_factory):
    files = sorted((DATA / "utfsm_sine").glob("*.csv.gz"))
    recording = imported(files, tmp_path_factory.mktemp("utfsm") / "utfsm.mcap")
    return recording, identify([recording], FitRequest(HoldOut(("5mm_4Hz*", "25mm_0.5Hz*"))))


@pytest.fixture(scope="session")
def random_stroke(tmp_path_factory):
    recording = imported([DATA / "nees_dyke" / "ranran_50.csv.gz"], tmp_path_factory.mktemp("nees") / "nees.mcap")
    return identify([recording], FitRequest(HoldOut(after_fraction=0.6)))


def test_every_file_becomes_a_stretch_driven_by_current(sines):
    recording, fit = sines
    assert len(recording.stretches) == 30
    assert fit.drive_unit == "A"
    assert fit.drive_range == (0.0, 1.0)


def test_sines_never_seen_are_repeated_better_than_by_a_quick_fit(sines):
    assert sines[1].nrmse.held_out <= 0.099


def test_a_random_stroke_never_seen_is_repeated_better_than_by_a_quick_fit(random_stroke):
    assert random_stroke.nrmse.held_out <= 0.181


@pytest.mark.parametrize("fitted", ["sines", "random_stroke"])
def test_the_fit_says_that_the_law_does_not_reach_the_noise(fitted, request):
    found = request.getfixturevalue(fitted)
    fit = found if fitted == "random_stroke" else found[1]
    assert fit.result.startswith("converged")
    assert "an effect is missing from the law" in fit.result


def test_a_current_that_never_changes_within_a_file_shows_no_eta(sines):
    eta = sines[1].coordinates["eta"]
    assert not eta.identifiable
    assert eta.ci95 is None

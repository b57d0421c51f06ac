"""What planned strokes can tell: information, words, the stroke to add."""

import json

import numpy as np
import pytest
from test_fit import LABORATORY, problem_of, sine

from identification.errors import IdentificationError
from identification.foresight.assumed import assumed_damper
from identification.foresight.foresee import Assumed, foresee
from identification.foresight.information import information, relative_covariance, sizes
from identification.foresight.planned import Addition, Planned, read_planned
from identification.refine import refine
from identification.uncertainty import coordinate_covariance, covariance

ASSUMED = Assumed("laboratory", LABORATORY, 2.5)
STEPS = sine(0.010, 2.0, levels=(0.0, 0.5) * 6)
SLOW = sine(0.010, 0.5, levels=(0.3,))
STEPS_SEGMENT = {
    "name": "steps", "motion": {"kind": "sine", "amplitude_m": 0.01, "frequency_hz": 2.0}, "duration_s": 6.0,
    "drive": {"kind": "steps", "time_s": [0.0, 0.5], "values": [0.0, 0.5]},
}  # fmt: skip
SLOW_SEGMENT = {
    "name": "slow", "motion": {"kind": "sine", "amplitude_m": 0.01, "frequency_hz": 0.5}, "duration_s": 6.0,
    "drive": {"kind": "constant", "value": 0.3},
}  # fmt: skip


def plan(stroke, *additions):
    return Planned("tested", "V", stroke, additions)


def test_the_deviation_foreseen_is_that_of_the_fit():
    stroke = sine(0.010, 2.0, levels=(0.0, 0.3, 0.1, 0.5, 0.2, 0.4))
    problem = problem_of(LABORATORY, [stroke])
    minimum = refine(problem)
    spread = coordinate_covariance(problem, minimum, covariance(problem, minimum))
    found = np.sqrt(np.diag(spread)) / sizes(LABORATORY)
    foreseen = np.sqrt(np.diag(relative_covariance(information(LABORATORY, stroke, 2.5))))
    np.testing.assert_allclose(foreseen, found, rtol=0.2)


def test_with_one_drive_everything_that_grows_with_drive_is_unseen_and_said_so():
    found = foresee(plan(sine(0.010, 2.0, levels=(0.3,))), ASSUMED)
    for name in ("F_b", "c0_b", "c1_b", "eta"):
        assert not found.coordinates[name].fixed
        assert "cannot be seen: the drive never changes" in found.coordinates[name].note
    assert found.coordinates["D_y"].fixed


def test_a_drive_that_changes_only_at_rest_hides_eta():
    moving = sine(0.010, 2.0, levels=(0.0, 0.5))
    still = 1000
    pause = np.concatenate([np.zeros(still), np.zeros(still)])
    half = len(moving.displacement) // 2
    parts = {
        name: np.concatenate([getattr(moving, name)[:half], pause, getattr(moving, name)[half:]])
        for name in ("displacement", "velocity", "acceleration")
    }
    drive = np.concatenate([np.zeros(half + still), np.full(still + half, 0.5)])
    stroke = type(moving)(1000.0, **parts, drive=drive)
    note = foresee(plan(stroke), ASSUMED).coordinates["eta"].note
    assert "never changes inside a stroke" in note


def test_the_stroke_to_add_is_the_one_that_shows_what_is_missing():
    lacking = sine(0.010, 2.0, levels=(0.3,))
    found = foresee(plan(lacking, Addition(SLOW_SEGMENT, SLOW), Addition(STEPS_SEGMENT, STEPS)), ASSUMED)
    assert found.add is not None
    assert found.add.segment == STEPS_SEGMENT
    assert found.add.gains["eta"].before_percent is None
    assert found.add.gains["eta"].after_percent < 5
    assert "drive steps between 0 and 0.5 inside the strokes" in found.words[-1]


def test_nothing_is_added_to_strokes_that_tell_everything():
    rich = sine(0.010, 2.0, seconds=24.0, levels=(0.0, 0.3, 0.1, 0.5, 0.2, 0.4) * 6)
    found = foresee(plan(rich, Addition(STEPS_SEGMENT, STEPS)), ASSUMED)
    assert found.add is None
    assert found.words[-1] == "nothing needs to be added"


def test_less_noise_tells_more():
    loud, quiet = (foresee(plan(STEPS), Assumed("x", LABORATORY, n)) for n in (5.0, 1.0))
    for name, e in quiet.coordinates.items():
        # Not five times better everywhere: the clocks' delays hold D_y and what goes with it.
        assert 0.19 < e.percent / loud.coordinates[name].percent < 0.6


def test_a_file_of_planned_strokes_is_read_and_a_broken_one_refused(tmp_path):
    channels = np.stack([STEPS.displacement, STEPS.velocity, STEPS.acceleration, STEPS.drive])
    info = {"method": "m", "rate_hz": 1000.0, "drive_unit": "V", "additions": [SLOW_SEGMENT]}
    whole, broken = tmp_path / "whole.npz", tmp_path / "broken.npz"
    np.savez(whole, plan=channels, addition_0=channels, info=json.dumps(info))
    np.savez(broken, plan=channels[:3], info=json.dumps(info))
    found = read_planned(whole)
    assert found.method == "m"
    assert found.additions[0].segment == SLOW_SEGMENT
    np.testing.assert_array_equal(found.stroke.drive, STEPS.drive)
    for path in (broken, tmp_path / "none.npz"):
        with pytest.raises(IdentificationError, match="no planned strokes"):
            read_planned(path)


def test_the_damper_to_expect_goes_by_the_drive():
    assert assumed_damper(None, "V", None).name == "laboratory"
    assert assumed_damper(None, "A", 1.0) == Assumed("lord_class", assumed_damper(None, "A", None).point, 1.0)

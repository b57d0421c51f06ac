"""Assessment of planned strokes: information, texts, the stroke to add."""

import json

import numpy as np
import pytest

from identification.errors import IdentificationError
from identification.experiment_design.assumed_damper import AssumedDamper, load_assumed_damper
from identification.experiment_design.design import assess_design
from identification.experiment_design.information import (
    compute_coordinate_scales,
    compute_information,
    compute_relative_covariance,
)
from identification.experiment_design.planned_strokes import OptionalStroke, PlannedStrokes, read_planned_strokes
from identification.fitting.output_error import fit_output_error
from identification.uncertainty.covariance import compute_coordinate_covariance, estimate_covariance
from tests.support.fit_problems import LABORATORY, problem_of, sine

ASSUMED = AssumedDamper("laboratory", LABORATORY, 2.5)
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
    return PlannedStrokes("tested", "V", stroke, additions)


def test_the_expected_deviation_is_that_of_the_fit():
    stroke = sine(0.010, 2.0, levels=(0.0, 0.3, 0.1, 0.5, 0.2, 0.4))
    problem = problem_of(LABORATORY, [stroke])
    minimum = fit_output_error(problem)
    spread = compute_coordinate_covariance(problem, minimum, estimate_covariance(problem, minimum))
    found = np.sqrt(np.diag(spread)) / compute_coordinate_scales(LABORATORY)
    expected = np.sqrt(np.diag(compute_relative_covariance(compute_information(LABORATORY, stroke, 2.5))))
    np.testing.assert_allclose(expected, found, rtol=0.2)


def test_with_one_drive_no_drive_dependent_coordinate_is_observable():
    found = assess_design(plan(sine(0.010, 2.0, levels=(0.3,))), ASSUMED)
    for name in ("F_b", "c0_b", "c1_b", "eta"):
        assert not found.coordinates[name].identifiable
        assert "is not observable: the drive never changes" in found.coordinates[name].note
    assert found.coordinates["D_y"].identifiable


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
    note = assess_design(plan(stroke), ASSUMED).coordinates["eta"].note
    assert "never changes during a stroke" in note


def test_the_stroke_to_add_is_the_one_that_shows_what_is_missing():
    lacking = sine(0.010, 2.0, levels=(0.3,))
    found = assess_design(
        plan(lacking, OptionalStroke(SLOW_SEGMENT, SLOW), OptionalStroke(STEPS_SEGMENT, STEPS)), ASSUMED
    )
    assert found.proposal is not None
    assert found.proposal.segment == STEPS_SEGMENT
    assert found.proposal.gains["eta"].before_percent is None
    assert found.proposal.gains["eta"].after_percent < 5
    assert "drive steps between 0 and 0.5 during the strokes" in found.messages[-1]


def test_no_stroke_is_proposed_where_every_coordinate_is_precise():
    rich = sine(0.010, 2.0, seconds=24.0, levels=(0.0, 0.3, 0.1, 0.5, 0.2, 0.4) * 6)
    found = assess_design(plan(rich, OptionalStroke(STEPS_SEGMENT, STEPS)), ASSUMED)
    assert found.proposal is None
    assert found.messages[-1] == "every coordinate is precise enough: no further stroke is needed"


def test_less_noise_means_smaller_deviations():
    loud, quiet = (assess_design(plan(STEPS), AssumedDamper("x", LABORATORY, n)) for n in (5.0, 1.0))
    for name, e in quiet.coordinates.items():
        # Not five times smaller everywhere: the clocks' delays limit D_y and what correlates with it.
        assert 0.19 < e.deviation_percent / loud.coordinates[name].deviation_percent < 0.6


def test_a_file_of_planned_strokes_is_read_and_a_broken_one_refused(tmp_path):
    channels = np.stack([STEPS.displacement, STEPS.velocity, STEPS.acceleration, STEPS.drive])
    info = {"method": "m", "rate_hz": 1000.0, "drive_unit": "V", "additions": [SLOW_SEGMENT]}
    whole, broken = tmp_path / "whole.npz", tmp_path / "broken.npz"
    np.savez(whole, plan=channels, addition_0=channels, info=json.dumps(info))
    np.savez(broken, plan=channels[:3], info=json.dumps(info))
    found = read_planned_strokes(whole)
    assert found.method == "m"
    assert found.optional_strokes[0].segment == SLOW_SEGMENT
    np.testing.assert_array_equal(found.excitation.drive, STEPS.drive)
    for path in (broken, tmp_path / "none.npz"):
        with pytest.raises(IdentificationError, match="not a file of planned strokes"):
            read_planned_strokes(path)


def test_the_assumed_damper_follows_the_unit_of_the_drive():
    assert load_assumed_damper(None, "V", None).name == "laboratory"
    assert load_assumed_damper(None, "A", 1.0) == AssumedDamper(
        "lord_class", load_assumed_damper(None, "A", None).coordinates, 1.0
    )

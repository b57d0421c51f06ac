"""Limitations of planned strokes, their explanation, and information, at and beside every limit."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from identification.damper import COORDINATES
from identification.documents import ExpectedPrecision, PrecisionGain
from identification.errors import IdentificationError
from identification.experiment_design.assumed_damper import AssumedDamper, load_assumed_damper
from identification.experiment_design.design import _assess_coordinates, _find_most_correlated, _make_proposal
from identification.experiment_design.explanation import (
    describe_design,
    describe_precision,
    describe_proposal,
    describe_segment,
    explain_unidentifiable,
)
from identification.experiment_design.information import (
    compute_coordinate_scales,
    compute_information,
    compute_relative_covariance,
    find_observable,
)
from identification.experiment_design.planned_strokes import (
    PlanLimitations,
    PlannedStrokes,
    find_plan_limitations,
    read_planned_strokes,
)
from identification.simulate import Excitation
from tests.support.fit_problems import LABORATORY, sine

Q = {q.symbol: q for q in COORDINATES}
RATE = 100.0


def stroke(peaks, changes_at=()):
    """Return one second at each peak speed, half of it at rest; the drive steps at samples."""
    velocity = np.concatenate([np.r_[np.full(50, peak), np.full(50, 0.001 * peak)] for peak in peaks])
    drive = np.zeros(len(velocity))
    for sample in changes_at:
        drive[sample:] += 0.1
    return Excitation(RATE, *np.zeros((1, len(velocity))), velocity, np.zeros(len(velocity)), drive)


@pytest.mark.parametrize(
    ("peaks", "same"),
    [
        ((0.1, 0.1), True),
        ((0.1, -0.149), True),
        ((0.1, 0.151), False),
        # The second at a sixth of the largest peak is a rest.
        ((0.1, 0.11, 0.018), True),
        ((0.1, 0.11, 0.025), False),
    ],
)
def test_strokes_have_one_velocity_if_their_peaks_differ_by_less_than_half(peaks, same):
    assert find_plan_limitations(stroke(peaks)).has_one_velocity == same


def test_strokes_shorter_than_a_second_have_one_velocity():
    t = np.arange(80) / RATE
    short = Excitation(RATE, t, np.cos(t), t, 0.0 * t)
    assert find_plan_limitations(short).has_one_velocity


def test_every_second_counts_up_to_the_last_sample():
    assert not find_plan_limitations(stroke((0.1, 0.1, 0.3))).has_one_velocity


@pytest.mark.parametrize(
    ("changes_at", "one_drive", "at_rest"),
    [((), True, True), ((60,), False, True), ((20,), False, False), ((60, 120), False, False)],
)
def test_a_drive_changes_never_at_rest_or_during_a_stroke(changes_at, one_drive, at_rest):
    found = find_plan_limitations(stroke((0.1, 0.1), changes_at))
    assert (found.has_one_drive, found.has_steps_only_at_rest) == (one_drive, at_rest)


@pytest.mark.parametrize(("step", "one_drive"), [(1e-10, True), (5e-9, False), (-5e-9, False)])
def test_rounding_of_a_drive_is_no_change(step, one_drive):
    given = stroke((0.1,))
    given.drive[60:] += step
    assert find_plan_limitations(given).has_one_drive == one_drive


FREE = PlanLimitations(False, False, False)


@pytest.mark.parametrize(
    ("symbol", "limits", "correlation", "reason"),
    [
        ("eta", PlanLimitations(True, True, True), 0.99, "not observable: the drive never changes"),
        ("c1_b", PlanLimitations(True, False, False), 0.99, "not observable: the drive never changes"),
        ("F_a", PlanLimitations(True, True, False), 0.0, "hardly affects the force of these strokes"),
        ("F_b", FREE, 0.0, "hardly affects the force of these strokes"),
        ("eta", PlanLimitations(False, True, False), 0.99, "never changes during a stroke"),
        ("F_b", PlanLimitations(False, True, False), 0.0, "hardly affects the force of these strokes"),
        ("eta", FREE, 0.0, "hardly affects the force of these strokes"),
        ("k0", FREE, 0.91, "cannot be distinguished from k1"),
        ("k0", FREE, -0.91, "cannot be distinguished from k1"),
        ("k0", FREE, 0.89, "hardly affects the force of these strokes"),
        ("c1_a", PlanLimitations(False, False, True), 0.0, "all strokes have about the same speed"),
        ("c1_a", FREE, 0.0, "hardly affects the force of these strokes"),
        ("k0", PlanLimitations(False, False, True), 0.0, "hardly affects the force of these strokes"),
    ],
)
def test_a_coordinate_is_unidentifiable_for_the_first_reason_that_applies(symbol, limits, correlation, reason):
    text = explain_unidentifiable(Q[symbol], limits, ("k1", correlation))
    assert text.startswith(f"{symbol} ({Q[symbol].meaning})")
    assert reason in text


def precision(percent, identifiable=True):
    return ExpectedPrecision(value=1.0, unit="N", deviation_percent=percent, identifiable=identifiable, note="why")


@pytest.mark.parametrize(
    ("coordinates", "first", "last"),
    [
        ({"F_a": precision(5.0), "n": precision(1.0)}, "F_a 5 %, n 1 %", "no further stroke is needed"),
        ({"F_a": precision(5.1), "n": precision(1.0)}, "F_a 5.1 %, n 1 %", "would improve these much"),
        ({"F_a": precision(60.0, False), "n": precision(1.0)}, "n 1 %", "would improve these much"),
        ({"F_a": precision(None, False)}, "no coordinate is identifiable", "would improve these much"),
    ],
)
def test_a_report_lists_what_is_identifiable_and_whether_that_is_enough(coordinates, first, last):
    lines = describe_design("m", "d", 2.5, coordinates, None, 0.05)
    assert lines[0].endswith(f"with m, for the damper d and 2.5 N of force noise: {first}")
    assert lines[-1].endswith(last)
    assert lines[1:-1] == ["why"] * sum(not e.identifiable for e in coordinates.values())


def test_texts_give_sizes_in_millimetres_and_per_cent():
    segment = {"motion": {"kind": "sine", "amplitude_m": 0.0125, "frequency_hz": 2.0}, "duration_s": 6.0,
               "drive": {"kind": "steps", "values": [0.3, 0.1, 0.5]}}  # fmt: skip
    text = "a sine of 12.5 mm at 2 Hz, 6 s, with 3 drive steps between 0.1 and 0.5 during the strokes"
    assert describe_segment(segment) == text
    gains = {
        "n": PrecisionGain(before_percent=None, after_percent=4.0),
        "k0": PrecisionGain(before_percent=9.0, after_percent=3.0),
    }
    assert describe_proposal(segment, gains) == f"add {text}: n from not observable to 4 %, k0 from 9 % to 3 %"
    assert describe_precision(Q["n"], 0.034).endswith("standard deviation 3.4 % at best")


def information(**deviations):
    """Return the information (15, 15) that gives relative deviations; others are known to a thousandth."""
    values = np.full(15, 1e6)
    for name, deviation in deviations.items():
        values[[q.symbol for q in COORDINATES].index(name)] = deviation**-2 - 0.01
    return np.diag(values)


def test_a_weak_prior_of_ten_sizes_adds_to_the_information():
    known = compute_relative_covariance(information(n=2.0))
    assert known.shape == (13, 13)
    assert known[4, 4] == pytest.approx(4.0)
    assert compute_relative_covariance(np.zeros((15, 15)))[0, 0] == pytest.approx(100.0)
    delays = np.zeros((15, 15))
    delays[0, 0] = delays[13, 13] = delays[0, 13] = delays[13, 0] = 1.0
    # The prior of a delay is one deviation: 1 + 0.01 - 1 / (1 + 1) remains.
    assert compute_relative_covariance(delays)[0, 0] == pytest.approx(1.0 / 0.51)


def test_a_coordinate_is_observable_with_more_information_than_the_prior():
    given = np.diag([0.009, 0.011, *np.ones(13)])
    np.testing.assert_array_equal(find_observable(given), [False, *[True] * 12])


def test_sizes_are_values_but_at_least_a_tenth_of_the_usual_scale():
    scales = compute_coordinate_scales(LABORATORY._replace(F_a=3.0, k0=-900.0, k1=0.0))
    assert scales[[0, 10, 11]] == pytest.approx([5.0, 900.0, 100.0])


def test_information_grows_with_the_inverse_square_of_the_noise():
    given = sine(0.01, 2.0, seconds=1.0)
    quiet, loud = (compute_information(LABORATORY, given, noise) for noise in (1.0, 1e3))
    # In much noise only the prior on y(0) is left, so nothing is lost to it.
    bare = loud * 1e6
    assert np.all(np.diag(bare) >= np.diag(quiet) * (1 - 1e-9))
    assert np.diag(bare)[0] == pytest.approx(np.diag(quiet)[0], rel=0.05)


@pytest.mark.parametrize(
    ("deviation", "identifiable", "percent"), [(0.49, True, 49.0), (0.51, False, 51.0), (1.01, False, None)]
)
def test_a_coordinate_is_identifiable_below_half_of_its_size(deviation, identifiable, percent):
    planned = PlannedStrokes("m", "V", sine(0.01, 2.0, seconds=1.0), ())
    found = _assess_coordinates(planned, AssumedDamper("d", LABORATORY, 2.5), information(n=deviation))
    assert (found["n"].identifiable, found["n"].deviation_percent) == (identifiable, percent)
    assert found["rho"].deviation_percent == pytest.approx(0.1)
    assert found["F_b"].unit == "N/V"


def test_an_unobservable_coordinate_has_no_deviation():
    planned = PlannedStrokes("m", "V", sine(0.01, 2.0, seconds=1.0), ())
    found = _assess_coordinates(planned, AssumedDamper("d", LABORATORY, 2.5), information(n=10.0))
    assert found["n"].deviation_percent is None
    assert not found["n"].identifiable


def test_the_most_correlated_coordinate_is_another_one():
    covariance = np.diag(np.full(13, 4.0))
    covariance[4, 10] = covariance[10, 4] = -3.0
    covariance[4, 3] = covariance[3, 4] = 2.0
    assert _find_most_correlated(covariance, 4) == ("k0", pytest.approx(-0.75))


def test_a_proposal_lists_only_improved_coordinates():
    before, after = np.full(13, 0.4), np.full(13, 0.1)
    before[1], improved, observable = 1.5, np.zeros(13, bool), np.ones(13, bool)
    improved[[0, 1, 2]], observable[2] = True, False
    chosen = SimpleNamespace(
        segment={"motion": {"kind": "sine", "amplitude_m": 0.01, "frequency_hz": 1.0},
                 "drive": {"kind": "constant", "value": 0.3}}
    )  # fmt: skip
    gains = _make_proposal(chosen, before, after, improved, observable).gains
    assert {k: (g.before_percent, g.after_percent) for k, g in gains.items()} == {
        "F_a": (40.0, 10.0),
        "F_b": (None, 10.0),
        "D_y": (None, 10.0),
    }


def write_plan(path, channels):
    info = {"method": "m", "rate_hz": 1000.0, "drive_unit": "V", "additions": []}
    np.savez(path, plan=channels, info=json.dumps(info))
    return path


@pytest.mark.parametrize("channels", [np.zeros((4, 199)), np.zeros((5, 300)), np.zeros((3, 300)), np.zeros(800)])
def test_a_plan_with_too_few_samples_or_other_channels_is_refused(tmp_path, channels):
    with pytest.raises(IdentificationError, match="4 channels of at least 200 samples"):
        read_planned_strokes(write_plan(tmp_path / "p.npz", channels))


def test_a_plan_of_200_samples_is_read_and_one_with_a_gap_refused(tmp_path):
    assert read_planned_strokes(write_plan(tmp_path / "p.npz", np.zeros((4, 200)))).excitation.rate == 1000.0
    with pytest.raises(IdentificationError, match="a sample is not finite"):
        read_planned_strokes(write_plan(tmp_path / "q.npz", np.full((4, 200), np.nan)))


def test_a_noise_that_is_given_replaces_that_of_the_model(fit, tmp_path):
    assert load_assumed_damper(None, "V", None).noise == 2.5
    assert load_assumed_damper(None, "V", 7.0).noise == 7.0
    path = tmp_path / "fit.json"
    path.write_text(fit.model_dump_json(by_alias=True))
    assert load_assumed_damper(path, "V", None).noise == fit.noise_floor_n
    assert load_assumed_damper(path, "V", 7.0).noise == 7.0
    with pytest.raises(IdentificationError, match="driven in V, the method in A"):
        load_assumed_damper(path, "A", None)
    path.write_text(json.dumps({"schema": "mrbench.scenario/1", "damper": "laboratory"}))
    assert load_assumed_damper(path, "A", None).noise == 2.5
    assert load_assumed_damper(path, "A", 7.0).noise == 7.0

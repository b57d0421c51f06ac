"""Comparison of runs whose cycles are known exactly."""

from datetime import UTC, datetime

import numpy as np
import pytest

from bench.comparison import ComparedRun, ComparisonRequest, ForceSeries, RecordedRun, compare_runs
from bench.samples import SampleStore
from tests.support.cyclic_logs import DAMPING, FRICTION, write_cyclic_log

SPEED = 0.01 * 2 * np.pi * 2.0
PEAK = FRICTION + DAMPING * SPEED
"""Peak force at 0.1 V [N]."""


def make_run(folder, run="a", fit=None, series=None, method="quick", **changes):
    path = write_cyclic_log(folder / f"{run}.mcap", run, **changes)
    table = SampleStore(folder).load(path, None)
    facts = ComparedRun(run=run, specimen="damper 7", method=method, started=datetime.now(UTC), fit=None)
    return RecordedRun(facts, table, fit, series)


def compare(*runs, **changes):
    names = tuple(run.facts.run for run in runs)
    return compare_runs(runs, ComparisonRequest(runs=names, **changes))


def make_series(run, width):
    time = run.table.time
    column = np.zeros(len(time))
    names = ("displacement", "velocity", "drive", "force", "simulated")
    held_out = np.zeros(len(time), bool)
    return ForceSeries(time, dict.fromkeys(names, column), held_out, np.full(len(time), width), "V")


@pytest.fixture
def first(tmp_path):
    return make_run(tmp_path)


def list_texts(comparison):
    return sorted({difference.text for difference in comparison.differences})


def test_peaks_and_energy_are_those_of_the_cycle(first, tmp_path):
    stroke = compare(first, make_run(tmp_path, "b")).strokes[0].strokes[0]
    assert (stroke.cycles, stroke.frequency_hz) == (3, pytest.approx(2.0, rel=1e-3))
    assert stroke.amplitude_m == pytest.approx(0.01, rel=1e-3)
    assert stroke.peak_tension_n == pytest.approx(PEAK, rel=1e-3)
    assert stroke.peak_compression_n == pytest.approx(-PEAK, rel=1e-3)
    assert stroke.peak_velocity_mps == pytest.approx(SPEED, rel=1e-3)
    # Viscous part π c ω a², and four times the friction over the amplitude, less at the reversals.
    assert stroke.energy_j == pytest.approx(np.pi * DAMPING * SPEED * 0.01 + 4 * FRICTION * 0.01, rel=0.05)
    assert stroke.energy_sd_j < 0.01


def test_cycles_are_aligned_by_phase_whatever_their_start(first, tmp_path):
    (stroke, _) = compare(first, make_run(tmp_path, "b", shift=0.37)).strokes
    one, other = (np.array(run.curve.force_n) for run in stroke.strokes)
    assert np.abs(one - other).max() < 0.05 * PEAK
    phase = np.array(stroke.strokes[0].curve.phase)
    expected = 0.01 * np.sin(2 * np.pi * phase)
    np.testing.assert_allclose(stroke.strokes[1].curve.displacement_m, expected, atol=3e-4)


@pytest.mark.parametrize("shift", [0.0, 0.001, 0.37])
def test_a_curve_has_the_values_at_the_middle_of_each_phase_wherever_the_samples_are(first, tmp_path, shift):
    curve = compare(first, make_run(tmp_path, "b", shift=shift)).strokes[0].strokes[1].curve
    angle = 2 * np.pi * np.array(curve.phase)
    np.testing.assert_allclose(curve.displacement_m, 0.01 * np.sin(angle), atol=5e-6)
    np.testing.assert_allclose(curve.velocity_mps, SPEED * np.cos(angle), atol=1e-3 * SPEED)


def test_equal_runs_have_no_differences(first, tmp_path):
    comparison = compare(first, make_run(tmp_path, "b"))
    assert (comparison.differences, comparison.notes, comparison.verdicts) == ((), (), ())


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"amplitude": 0.011}, "stroke: 10 mm against 11 mm"),
        ({"frequency": 2.1}, "rate: 2 Hz against 2.1 Hz"),
        ({"preload": 30.0}, "preload: 0 N against 30 N"),
        ({"method": "long"}, "method: quick against long"),
        ({"drives": (0.108, 0.32), "name": "near"}, "drive: 0.3 V against 0.32 V"),
    ],
)
def test_a_condition_that_differs_is_named_with_both_values(first, tmp_path, changes, text):
    assert text in list_texts(compare(first, make_run(tmp_path, "b", **changes)))


def test_a_difference_of_temperature_is_named(tmp_path):
    runs = [make_run(tmp_path, name, temperature=value) for name, value in (("a", 21.0), ("b", 24.5))]
    assert list_texts(compare(*runs)) == ["temperature: 21 °C against 24.5 °C"]
    assert list_texts(compare(runs[0], make_run(tmp_path, "c"))) == []


def test_strokes_of_other_names_match_by_motion_and_drive(first, tmp_path):
    comparison = compare(first, make_run(tmp_path, "b", name="part at {drive:g}"))
    assert [stroke.strokes[1].segment for stroke in comparison.strokes] == ["part at 0.1", "part at 0.3"]


def test_runs_without_a_common_stroke_say_so(first, tmp_path):
    comparison = compare(first, make_run(tmp_path, "b", drives=(0.8,), frequency=5.0))
    assert comparison.strokes == ()
    assert "No stroke of the first run has a counterpart" in comparison.notes[0]


def test_a_run_within_the_tolerance_passes_at_each_drive(first, tmp_path):
    comparison = compare(first, make_run(tmp_path, "b", gain=1.03), reference="a", tolerance_percent=5)
    assert [(one.run, one.drive, one.result) for one in comparison.verdicts] == [
        ("b", 0.1, "pass"), ("b", 0.3, "pass"),
    ]  # fmt: skip
    assert comparison.strokes[0].band.model_uncertainty_n is None
    assert "contains the tolerance alone" in comparison.notes[0]


def test_a_run_outside_fails_and_says_by_how_much(first, tmp_path):
    comparison = compare(first, make_run(tmp_path, "b", gain=1.2), reference="a", tolerance_percent=5)
    assert {one.result for one in comparison.verdicts} == {"fail"}
    (test,) = comparison.strokes[0].band.tests
    assert test.largest_excess_n == pytest.approx(0.15 * PEAK, rel=0.05)
    assert (test.margin_n, test.inside < 0.95) == (-test.largest_excess_n, True)


def test_the_band_contains_the_uncertainty_of_the_model(tmp_path):
    reference = make_run(tmp_path, "a")
    wide = make_run(tmp_path, "a", series=make_series(reference, 0.2 * PEAK))
    comparison = compare(wide, make_run(tmp_path, "b", gain=1.2), reference="a", tolerance_percent=5)
    assert comparison.strokes[0].band.model_uncertainty_n == pytest.approx(0.2 * PEAK)
    assert comparison.verdicts[0].result == "pass"


def test_parameters_outside_the_intervals_of_each_other_differ(tmp_path):
    def fit(value):
        entry = {"value": value, "unit": "N s/m", "ci95": [value - 10, value + 10], "identifiable": True}
        return {"parameters": {"c0_a": entry, "A": entry | {"ci95": None}}}

    runs = [make_run(tmp_path, name, fit=fit(value)) for name, value in (("a", 800.0), ("b", 850.0))]
    (found,) = compare(*runs).parameters
    assert (found.name, found.values, found.differs) == ("c0_a", {"a": 800.0, "b": 850.0}, True)
    assert not compare(runs[0], make_run(tmp_path, "c", fit=fit(805.0))).parameters[0].differs

"""Parameters follow the gains of the channels as their units say, and intervals combine in quadrature."""

from dataclasses import replace

import numpy as np
import pytest

from bench.calibration import combine_estimates, combine_interval, find_exponents, make_log_text
from identification.damper import COORDINATES, PARAMETERS, Parameters
from identification.damper.coordinates import to_coordinates
from identification.damper.parameter_sets import find_parameter_set
from identification.pipeline import FitRequest, identify
from identification.simulate import Excitation, SimulationModel, simulate
from tests.support.certificates import issue_certificate
from tests.support.short_fit import recording

LABORATORY = find_parameter_set("laboratory").parameters
CHECKED = ("F_a", "F_b", "D_y", "c0_a", "c0_b", "c1_a", "k0", "k1", "f0", "n", "eta", "rho")


def scale(parameters, gains):
    """Return a damper as a recording with these gains shows it."""
    values = {}
    for quantity in PARAMETERS:
        exponents = find_exponents(quantity.format_unit("V"), parameters.n)
        factor = np.prod([gains[gain] ** power for gain, power in exponents.items()])
        values[quantity.symbol] = getattr(parameters, quantity.symbol) * factor
    return Parameters(**values)


def stroke_force(parameters, displacement_gain=1.0, drive_gain=1.0):
    """Simulate a sine at a rising drive; the gains scale what is recorded of both.

    The first tenth of a second is left out: the state at the start is a choice of the simulation, in metres.
    """
    time, w = np.arange(3000) / 1000.0, 2 * np.pi * 1.5
    drive = drive_gain * np.where(time < 1.0, 0.1, 0.4)
    x, velocity = displacement_gain * 0.01 * np.array([np.sin(w * time), w * np.cos(w * time)])
    stroke = Excitation(1000.0, x, velocity, -w * w * x, drive)
    model, travel = SimulationModel(to_coordinates(parameters)), 0.005 * displacement_gain
    return simulate(model, stroke, max_travel=travel).force[100:]


@pytest.mark.parametrize(
    "gains",
    [
        {"force": 1.01, "displacement": 1.0, "drive": 1.0},
        {"force": 1.0, "displacement": 1.01, "drive": 1.0},
        {"force": 1.0, "displacement": 1.0, "drive": 0.98},
        {"force": 1.02, "displacement": 0.97, "drive": 1.05},
    ],
)
def test_a_damper_with_scaled_parameters_has_the_scaled_recording(gains):
    expected = gains["force"] * stroke_force(LABORATORY)
    scaled = stroke_force(scale(LABORATORY, gains), gains["displacement"], gains["drive"])
    assert np.max(np.abs(scaled - expected)) < 1e-5 * np.max(np.abs(expected))


def test_every_parameter_and_coordinate_has_a_known_unit():
    for quantity in (*PARAMETERS, *COORDINATES):
        for drive in ("V", "A"):
            assert find_exponents(quantity.format_unit(drive), 2.0) is not None
    assert find_exponents("N K/m", 2.0) is None


@pytest.mark.parametrize(
    ("unit", "exponents"),
    [
        ("N s/(m A)", {"force": 1, "displacement": -1, "drive": -1}),
        ("1/m^n", {"displacement": -1.9}),
        ("1/s", {}),
        ("N/V", {"force": 1, "drive": -1}),
    ],
)
def test_exponents_follow_from_the_unit(unit, exponents):
    assert find_exponents(unit, 1.9) == exponents


@pytest.fixture(scope="module")
def plain():
    return identify([recording()], FitRequest())


@pytest.mark.parametrize("channel", ["force", "displacement"])
def test_a_fit_of_a_scaled_recording_changes_each_coordinate_as_its_unit_says(plain, channel):
    """The noise is scaled with the force, so that both fits see the same data in other units."""
    original = recording()
    (stretch,) = original.stretches
    changes = {channel: 1.01 * getattr(stretch, channel)}
    scaled = identify([replace(original, stretches=(replace(stretch, **changes),))], FitRequest())
    for name in CHECKED:
        before, after = plain.coordinates[name], scaled.coordinates[name]
        power = find_exponents(before.unit, plain.coordinates["n"].value).get(channel, 0.0)
        half_width = (before.ci95[1] - before.ci95[0]) / 2
        assert after.value == pytest.approx(before.value * 1.01**power, abs=0.05 * half_width), name


def test_an_interval_grows_in_quadrature_on_each_side():
    """4 and 3 parts of the half-widths give 5."""
    low, high = combine_interval(100.0, (96.0, 108.0), {"force": 1.0}, {"force": 0.03 / 1.96}).ci95
    assert (low, high) == (pytest.approx(95.0), pytest.approx(100 + np.hypot(8.0, 3.0)))


def test_gains_are_independent_and_their_exponents_count():
    combined = combine_interval(
        1.0, None, {"force": 1, "displacement": -2}, {"force": 0.003, "displacement": 0.002}
    )
    assert combined.calibration == pytest.approx(0.005)
    assert combined.ci95 is None


def test_a_gain_without_a_certificate_leaves_the_interval_open():
    combined = combine_interval(1.0, (0.9, 1.1), {"force": 1, "displacement": -1}, {"force": 0.003})
    assert (combined.ci95, combined.missing) == (None, ("displacement",))


def test_estimates_are_combined_by_the_record_of_the_log():
    issued = issue_certificate(uncertainty={"value": 0.02, "kind": "relative", "coverage_factor": 2})
    text = make_log_text(issued, issued.document.date, "")
    estimates = {
        "F_a": {"value": 50.0, "unit": "N", "ci95": [49.0, 51.0]},
        "eta": {"value": 80.0, "unit": "1/s", "ci95": [79.0, 81.0]},
        "k0": {"value": 900.0, "unit": "N/m", "ci95": None},
        "heat": {"value": 1.0, "unit": "J/K", "ci95": None},
    }
    combined = combine_estimates(estimates, 2.0, {"force": text, "displacement": "none given"})
    assert combined["F_a"].ci95 == pytest.approx((50 - np.hypot(1, 0.98), 50 + np.hypot(1, 0.98)))
    assert combined["eta"].ci95 == (79.0, 81.0)
    assert combined["k0"].missing == ("displacement",)
    assert "heat" not in combined

"""Drift of the force's delay within a run: its size, and the wider intervals that it causes."""

from dataclasses import replace

import numpy as np
import pytest

from identification.damper.coordinates import Coordinates
from identification.fitting.dataset import assemble
from identification.fitting.output_error import OptimiserSettings, fit_output_error
from identification.pipeline import FitRequest, identify, make_problem
from identification.uncertainty.clock_drift import correct_clock_drift, describe_clock_drift
from identification.uncertainty.covariance import compute_coordinate_covariance, estimate_covariance
from tests.support.laboratory import FAST, SLOW, recording

K0 = Coordinates._fields.index("k0")


def late(stretch, delay):
    """The stretch with a force that is late by (N,) [s]."""
    at = stretch.time - delay
    return replace(stretch, force=np.interp(at, stretch.time, stretch.force))


def ended(*stretches):
    assembled = assemble([recording(*stretches)])
    problem = make_problem(assembled, 200e-6)
    return problem, fit_output_error(problem, OptimiserSettings(restarts=0), lambda message, error: None)


def bent(size):
    return lambda s: late(s, size * np.interp(s.time, [0.0, 4.0, 8.0], [1.0, -1.0, 1.0]))


def test_a_constant_delay_is_no_drift():
    problem, minimum = ended(late(SLOW, 1e-4), late(FAST, 1e-4))
    moved, drift = correct_clock_drift(problem, minimum)
    assert drift < 15e-6
    assert describe_clock_drift(0.0) == ()
    assert np.abs(moved.unknowns - minimum.unknowns).max() < 0.1


@pytest.mark.parametrize("size", [60e-6, 120e-6])
def test_a_drift_is_found_in_its_size(size):
    problem, minimum = ended(bent(size)(SLOW), bent(size)(FAST))
    _, drift = correct_clock_drift(problem, minimum)
    assert 0.4 * size < drift < 2.0 * size


def test_the_coordinates_that_it_biases_are_corrected_with_wider_intervals():
    problem, minimum = ended(bent(120e-6)(SLOW), bent(120e-6)(FAST))
    truth_problem, truth = ended(SLOW, FAST)
    moved, _ = correct_clock_drift(problem, minimum)
    deviation = {}
    for name, end in (("before", minimum), ("after", moved)):
        spread = compute_coordinate_covariance(problem, end, estimate_covariance(problem, end))
        found = problem.space.to_coordinates(end.unknowns[:13]).k0
        wanted = truth_problem.space.to_coordinates(truth.unknowns[:13]).k0
        deviation[name] = (abs(found - wanted) / np.sqrt(spread[K0, K0]), np.sqrt(spread[K0, K0]))
    assert deviation["after"][0] < min(deviation["before"][0], 2.5)
    assert deviation["after"][1] > 1.2 * deviation["before"][1]


def test_a_fit_notes_the_drift():
    fit = identify([recording(bent(100e-6)(SLOW), bent(100e-6)(FAST))], FitRequest(delay_prior=200e-6))
    assert any("drifts by" in note and "µs" in note for note in fit.notes)
    plain = identify([recording(SLOW, FAST)], FitRequest(delay_prior=200e-6))
    assert not any("drifts" in note for note in plain.notes)

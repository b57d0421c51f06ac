"""A delay of the force that bends within the run: found, and in the intervals of what it moves."""

from dataclasses import replace

import numpy as np
import pytest
from test_identify import FAST, SLOW, recording

from identification.assemble import assemble
from identification.clock_wander import wander_in_words, without_wander
from identification.damper.coordinates import Coordinates
from identification.identify import Request, fit_problem, identify
from identification.refine import Settings, refine
from identification.uncertainty import coordinate_covariance, covariance

K0 = Coordinates._fields.index("k0")


def late(stretch, delay):
    """The stretch with a force that is late by (N,) [s]."""
    at = stretch.time - delay
    return replace(stretch, force=np.interp(at, stretch.time, stretch.force))


def ended(*stretches):
    assembled = assemble([recording(*stretches)])
    problem = fit_problem(assembled, 200e-6)
    return problem, refine(problem, Settings(restarts=0), lambda what, error: None)


def bent(size):
    return lambda s: late(s, size * np.interp(s.time, [0.0, 4.0, 8.0], [1.0, -1.0, 1.0]))


def test_a_steady_delay_is_no_wander():
    problem, minimum = ended(late(SLOW, 1e-4), late(FAST, 1e-4))
    moved, wander = without_wander(problem, minimum)
    assert wander < 15e-6
    assert wander_in_words(0.0) == ()
    assert np.abs(moved.unknowns - minimum.unknowns).max() < 0.1


@pytest.mark.parametrize("size", [60e-6, 120e-6])
def test_a_wander_is_found_in_its_size(size):
    problem, minimum = ended(bent(size)(SLOW), bent(size)(FAST))
    _, wander = without_wander(problem, minimum)
    assert 0.4 * size < wander < 2.0 * size


def test_what_it_moves_is_put_back_and_less_sure():
    problem, minimum = ended(bent(120e-6)(SLOW), bent(120e-6)(FAST))
    truth_problem, truth = ended(SLOW, FAST)
    moved, _ = without_wander(problem, minimum)
    deviation = {}
    for name, end in (("before", minimum), ("after", moved)):
        spread = coordinate_covariance(problem, end, covariance(problem, end))
        found = problem.space.to_coordinates(end.unknowns[:13]).k0
        wanted = truth_problem.space.to_coordinates(truth.unknowns[:13]).k0
        deviation[name] = (abs(found - wanted) / np.sqrt(spread[K0, K0]), np.sqrt(spread[K0, K0]))
    assert deviation["after"][0] < min(deviation["before"][0], 2.5)
    assert deviation["after"][1] > 1.2 * deviation["before"][1]


def test_a_fit_says_what_wandered():
    fit = identify([recording(bent(100e-6)(SLOW), bent(100e-6)(FAST))], Request(delay_prior=200e-6))
    assert any("wanders by" in note and "µs" in note for note in fit.notes)
    plain = identify([recording(SLOW, FAST)], Request(delay_prior=200e-6))
    assert not any("wanders" in note for note in plain.notes)

"""Intervals by profile likelihood: as the covariance where the cost is a parabola, lopsided where it is not."""

import numpy as np
import pytest
from test_fit import LABORATORY, STROKES, problem_of, sine

from identification.profile import profile_intervals
from identification.refine import refine
from identification.uncertainty import coordinate_covariance, covariance


def both(problem):
    minimum = refine(problem)
    found = covariance(problem, minimum)
    deviation = np.sqrt(np.diag(coordinate_covariance(problem, minimum, found)))
    point = problem.space.to_coordinates(minimum.unknowns[:13])
    return point, deviation, profile_intervals(problem, minimum, found, lambda what, error: None)


def test_where_everything_is_known_well_the_two_agree():
    point, deviation, profile = both(problem_of(LABORATORY, STROKES))
    for name, value, sd in zip(point._fields, point, deviation, strict=True):
        low, high = profile[name]
        assert high - low == pytest.approx(2 * 1.96 * sd, rel=0.12), name
        assert low < value < high


def test_where_little_is_known_the_cost_itself_is_asked():
    problem = problem_of(LABORATORY, [sine(0.010, 1.0, seconds=2.0, levels=(0.0, 0.5))])
    point, _, profile = both(problem)
    low, high = profile["c1_b"]
    upward, downward = high - point.c1_b, point.c1_b - low
    assert abs(upward / downward - 1) > 0.1
    minimum = refine(problem)
    for end in (low, high):
        held = point._replace(c1_b=end)
        started = problem.start(held)
        started[13:] = minimum.unknowns[13:]
        # Held there with all else unchanged, the cost lies above what the interval allows: others must give way.
        assert problem.cost(started) - minimum.evaluation.cost > 3.84

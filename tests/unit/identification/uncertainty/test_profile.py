"""Profile-likelihood intervals: those of the covariance where the cost is a parabola, asymmetric elsewhere."""

import numpy as np
import pytest

from identification.fitting.output_error import fit_output_error
from identification.progress import ignore_progress
from identification.uncertainty.covariance import compute_coordinate_covariance, estimate_covariance
from identification.uncertainty.profile import compute_profile_intervals
from tests.support.fit_problems import LABORATORY, STROKES, problem_of, sine


def both(problem):
    minimum = fit_output_error(problem)
    found = estimate_covariance(problem, minimum)
    deviation = np.sqrt(np.diag(compute_coordinate_covariance(problem, minimum, found)))
    point = problem.space.to_coordinates(minimum.unknowns[:13])
    return point, deviation, compute_profile_intervals(problem, minimum, found, ignore_progress)


def test_for_a_well_determined_damper_both_intervals_agree():
    point, deviation, profile = both(problem_of(LABORATORY, STROKES))
    for name, value, sd in zip(point._fields, point, deviation, strict=True):
        low, high = profile[name]
        assert high - low == pytest.approx(2 * 1.96 * sd, rel=0.12), name
        assert low < value < high


def test_for_a_poorly_determined_damper_the_profile_is_asymmetric():
    problem = problem_of(LABORATORY, [sine(0.010, 1.0, seconds=2.0, levels=(0.0, 0.5))])
    point, _, profile = both(problem)
    low, high = profile["c1_b"]
    upward, downward = high - point.c1_b, point.c1_b - low
    assert abs(upward / downward - 1) > 0.1
    minimum = fit_output_error(problem)
    for end in (low, high):
        held = point._replace(c1_b=end)
        started = problem.make_start(held)
        started[13:] = minimum.unknowns[13:]
        # With all other unknowns unchanged the cost exceeds what the interval allows: the others must follow.
        assert problem.compute_cost(started) - minimum.evaluation.cost > 3.84

"""A fit from a given start: the shape of the loop is held first where the start is as distant as a regression."""

import numpy as np
import pytest

from identification.fitting import OptimiserSettings, fit_output_error, output_error
from identification.fitting.initial_guess import make_starting_points
from tests.support.fit_problems import LABORATORY, STROKES, problem_of


@pytest.fixture(scope="module")
def problem():
    return problem_of(LABORATORY, STROKES[1:2])


@pytest.fixture
def held(monkeypatch):
    """Masks of the unknowns that each minimisation held; None for none."""
    masks, minimise = [], output_error.minimise

    def watch(problem, start, iterations, progress, held=None, tolerance=0.0):
        masks.append(held)
        return minimise(problem, start, min(iterations, 2), progress, held, tolerance)

    monkeypatch.setattr(output_error, "minimise", watch)
    return masks


@pytest.mark.parametrize(
    ("given", "holds_shape", "phases"), [(True, False, 1), (True, True, 3), (False, False, 3), (False, True, 3)]
)
def test_the_shape_is_held_from_a_regression_and_on_request(problem, held, given, holds_shape, phases):
    start = problem.make_start(LABORATORY) if given else None
    fit_output_error(problem, OptimiserSettings(restarts=0, holds_shape=holds_shape), start=start)
    assert len(held) == phases
    assert held[-1] is None
    if phases > 1:
        expected = np.zeros(problem.layout.size, bool)
        expected[problem.layout.coordinates] = problem.space.shape_mask
        np.testing.assert_array_equal(held[0], expected)
        assert 0 < expected.sum() < 13


def test_the_shape_is_not_held_unless_requested():
    assert not OptimiserSettings().holds_shape


def test_from_the_regression_the_same_minimum_is_found_with_a_given_start(problem):
    start = make_starting_points(problem)[0]
    settings = OptimiserSettings(restarts=0)
    usual = fit_output_error(problem, settings)
    given = fit_output_error(problem, OptimiserSettings(restarts=0, holds_shape=True), start=start)
    np.testing.assert_array_equal(given.unknowns, usual.unknowns)

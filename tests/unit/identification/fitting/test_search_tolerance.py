"""Tolerance of a search: a minimisation ends where a step is expected to remove too little of the excess."""

import pytest

from identification.fitting import OptimiserSettings, fit_output_error, make_starting_points, minimise
from identification.progress import ignore_progress
from tests.support.candidate_pools import make_pool


@pytest.fixture(scope="module")
def problem():
    """Recording with an end stop, which the law alone cannot follow: its excess stays large."""
    return make_pool("end_stop").problems.decimated


@pytest.fixture(scope="module")
def exact(problem):
    return minimise(problem, make_starting_points(problem)[0], 100, ignore_progress)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_a_tolerance_saves_steps_and_loses_at_most_a_few_of_its_parts_of_the_excess(problem, exact, tolerance):
    start = make_starting_points(problem)[0]
    loose = minimise(problem, start, 100, ignore_progress, tolerance=tolerance)
    excess = exact.evaluation.cost - problem.samples
    assert exact.converged
    assert loose.converged
    assert loose.iterations < exact.iterations
    assert 0.0 <= loose.evaluation.cost - exact.evaluation.cost < 20.0 * tolerance * excess


def count_steps(problem, tolerance):
    steps = []
    settings = OptimiserSettings(restarts=0, tolerance=tolerance)
    fit_output_error(problem, settings, lambda stage, rmse: steps.append(rmse))
    return len(steps)


def test_a_search_passes_its_tolerance_to_every_minimisation(problem):
    assert count_steps(problem, 1e-2) < 0.8 * count_steps(problem, 0.0)

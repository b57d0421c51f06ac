"""Input, budget and result text of a fit against numbers computed by hand."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identification.fitting.budget import Budget
from identification.fitting.output_error import (
    OptimiserSettings,
)
from identification.pipeline.fit_document import FitResult, _describe_result
from identification.pipeline.fit_input import _find_drive_range, _find_lowest_k0, make_problem
from identification.pipeline.fit_request import FitRequest
from tests.support.fit_problems import SCALES, SHORT, SLIDING, linear_force, piece_of


def test_the_lowest_k0_lets_y_grow_by_e_cubed_in_the_longest_stretch():
    assert _find_lowest_k0(SLIDING, SCALES) == pytest.approx(-3.0 * 600.0 / 6.0)
    shorter = piece_of(SHORT, linear_force(SHORT))
    assert _find_lowest_k0([*SLIDING, shorter], SCALES) == pytest.approx(-3.0 * 600.0 / 6.0, rel=1e-3)


def test_overshoots_do_not_widen_the_range_of_drives():
    drives = np.concatenate([[-9.0] * 4, np.linspace(0.0, 0.5, 992), [9.0] * 4])
    assert _find_drive_range(drives) == pytest.approx((0.0, 0.5), abs=2e-3)


@pytest.mark.parametrize(("stated", "prior", "limit"), [(None, 3e-5, np.inf), (1e-4, 1e-4, 3.0), (0.0, 1e-9, 3.0)])
def test_a_stated_prior_of_the_delays_is_binding(stated, prior, limit):
    held_out = replace(SLIDING[1], train=np.zeros(6000))
    far = replace(held_out, excitation=replace(held_out.excitation, drive=np.full(6000, 5.0)))
    dataset = SimpleNamespace(pieces=(SLIDING[0], far), delay_prior=3e-5, floor=SimpleNamespace(noise=2.5))
    problem = make_problem(dataset, stated)
    assert (problem.delay_prior, problem.delay_limit, problem.noise) == (prior, limit, 2.5)
    assert problem.space.highest_drive == pytest.approx(0.5)
    assert problem.pieces == (SLIDING[0],)


@pytest.mark.parametrize(
    ("stages", "network", "output_error"),
    [(("pinn", "refine"), 5.0, 5.0), (("pinn",), 10.0, 5.0), (("refine",), 5.0, 10.0)],
)
def test_a_processor_time_is_shared_by_the_stages_and_steps_are_not(stages, network, output_error):
    request = FitRequest(settings=OptimiserSettings(budget=Budget(seconds=10.0)), stages=stages)
    assert (request.network_budget.seconds, request.output_error_budget.seconds) == (network, output_error)
    for budget in (Budget(), Budget(steps=7)):
        request = FitRequest(settings=OptimiserSettings(budget=budget), stages=stages)
        assert (request.network_budget, request.output_error_budget) == (budget, budget)


def delay(value, outside=True):
    return SimpleNamespace(value=value, prior_sd=2e-4, outside_prior=outside)


@pytest.mark.parametrize(
    ("ratio", "late", "converged", "failure", "text"),
    [
        (1.19, delay(0.0, False), True, "", "converged"),
        (1.21, delay(0.0, False), True, "", "converged; the force error is 1.21 times the noise floor"),
        (1.0, delay(1.5e-3), True, "", "1.5 ms behind the displacement, more than the clocks explain (0.2 ms)"),
        (1.0, delay(-1.5e-3), True, "", "the force is 1.5 ms ahead of the displacement"),
        (1.0, delay(0.0, False), False, "", "not converged: stopped after 7 steps"),
        (1.0, delay(0.0, False), True, "bad network", "not converged: bad network"),
    ],
)  # fmt: skip
def test_the_result_of_a_fit_is_one_line(ratio, late, converged, failure, text):
    minimum = SimpleNamespace(converged=converged, iterations=7)
    result = _describe_result(FitResult(None, minimum, None, (), failure=failure), ratio, late)
    assert text in result
    assert result.startswith("converged") == (converged and not failure)

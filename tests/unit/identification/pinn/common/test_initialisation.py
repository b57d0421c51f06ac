"""Starts of a training."""

from itertools import islice

import pytest

from identification.pinn.common.initialisation import generate_starts
from tests.support.pinn_problem import make_problem


def test_in_the_second_start_the_outer_dashpot_increases_with_the_drive():
    first, second = (start.coordinates for start in islice(generate_starts(make_problem()), 2))
    assert second.c1_a == pytest.approx(first.c1_a / 5.0)
    assert second.c1_a + 0.5 * second.c1_b == pytest.approx(5.0 * (first.c1_a + 0.5 * first.c1_b))
    assert second[:8] == first[:8]

"""Starts of a training."""

from itertools import islice

import numpy as np
import pytest

from identification.pinn.common.initialisation import (
    InitialStates,
    MemorylessDamper,
    _measure_slips,
    generate_starts,
    smooth_force,
)
from identification.pinn.common.training_pieces import make_training_pieces
from tests.support.pinn_problem import TRUTH, make_problem


def test_in_the_second_start_the_outer_dashpot_increases_with_the_drive():
    first, second = (start.coordinates for start in islice(generate_starts(make_problem()), 2))
    assert second.c1_a == pytest.approx(first.c1_a / 5.0)
    assert second.c1_a + 0.5 * second.c1_b == pytest.approx(5.0 * (first.c1_a + 0.5 * first.c1_b))
    assert second[:8] == first[:8]


MEMORYLESS = MemorylessDamper((10.0, 30.0), (100.0, 200.0), (400.0, 1000.0), 500.0, 20.0)


def test_the_first_start_is_near_the_truth():
    start = next(generate_starts(make_problem()))
    c = start.coordinates
    for name in ("c0_a", "c0_b", "F_b"):
        assert getattr(c, name) == pytest.approx(getattr(TRUTH, name), rel=0.35), name
    assert c.k0 + c.k1 == pytest.approx(TRUTH.k0 + TRUTH.k1, rel=0.3)
    assert c.f0 == pytest.approx(TRUTH.f0, rel=0.3)
    assert 0.3 < c.D_y / TRUTH.D_y < 3.0
    assert 0.0 < start.misfit < 100.0
    assert start.effects.shape == (0,)


def test_coefficients_of_the_regression_have_units():
    damper = MemorylessDamper.make(np.array([*np.log([10.0, 30.0, 100.0, 200.0, 400.0, 1000.0]), 0.5, 0.4]))
    assert damper[:3] == tuple(pytest.approx(pair) for pair in MEMORYLESS[:3])
    assert damper[3:] == pytest.approx((500.0, 20.0))


@pytest.mark.parametrize(
    ("v", "drive", "inner"),
    [
        (0.01, 0.0, 0.01),  # the dashpot carries 4 N, less than the yield force
        (0.1, 0.0, (10.0 + 10.0) / 500.0),
        (-0.1, 0.0, -(10.0 + 10.0) / 500.0),
        (0.1, 0.5, (20.0 + 15.0) / 850.0),  # half way between both drives
    ],
)
def test_the_inner_point_follows_the_stroke_until_it_yields(v, drive, inner):
    assert MEMORYLESS.compute_inner_velocity(np.array([v]), np.array([drive])) == pytest.approx([inner])
    c1 = 400.0 + 600.0 * drive
    force = MEMORYLESS.compute_force(np.array([0.003]), np.array([v]), np.array([drive]))
    assert force == pytest.approx([c1 * inner + 1.5 - 20.0])


def test_the_force_is_smoothed_over_an_odd_number_of_samples():
    pulse = np.zeros(9)
    pulse[[0, 5]] = 3.0
    assert smooth_force(pulse, 300.0) == pytest.approx([2.0, 1.0, 0, 0, 1.0, 1.0, 1.0, 0, 0])  # 2.4 samples: 3
    assert smooth_force(pulse, 100.0) == pytest.approx(pulse)


def test_slips_count_from_the_last_extreme_to_the_change_of_sign():
    hysteretic = np.array([1.0, 1.0, 1.0, 1.0, -1.0, -1.0, -1.0, 1.0])
    slip = np.array([0.0, 2.0, 5.0, 4.0, 1.0, -3.0, -2.5, 0.0])
    # From the maximum 5 to 4, then from the minimum -3 to -2.5.
    assert _measure_slips(hysteretic, slip) == pytest.approx([1.0, 0.5])


@pytest.fixture(scope="module")
def states():
    (source,) = make_training_pieces(make_problem())
    return InitialStates(source, TRUTH), source


def test_initial_states_balance_the_forces_of_the_law(states):
    initial, source = states
    time = source.sample_times[200:-50]
    s = initial.evaluate(time)
    x, v = source.inputs.evaluate_motion(time)
    u = source.inputs.evaluate_field(time, TRUTH.eta, 0.0).u
    F, c0, c1 = (
        a + b * u for a, b in ((TRUTH.F_a, TRUTH.F_b), (TRUTH.c0_a, TRUTH.c0_b), (TRUTH.c1_a, TRUTH.c1_b))
    )
    balance = F * s.z + TRUTH.k0 * (x - s.y) + c0 * (v - s.y_rate) - c1 * s.y_rate
    assert np.median(np.abs(balance)) < 0.1 * np.median(F)
    force = c1 * s.y_rate + TRUTH.k1 * x - TRUTH.f0
    recorded = source.piece.force[200:-50]
    assert np.median(np.abs(force - recorded)) < 3.0 * make_problem().noise
    assert initial.make_slip_velocity()(time) == pytest.approx(v - s.y_rate)
    assert np.gradient(s.y, time) == pytest.approx(s.y_rate, abs=0.2 * np.abs(s.y_rate).max())
    assert np.abs(s.z).max() <= 1.0

"""Number of steps per sample, and the next linearisation of a connection with a gap."""

import numpy as np
import pytest

from identification.damper import Coordinates
from identification.damper.effects import EFFECTS
from identification.simulate import ActiveEffect, Excitation, SimulationModel, simulate
from identification.simulate.compliant_mount.integration import choose_sample_steps, compute_cell_force
from identification.simulate.compliant_mount.stages import _choose_elongation, find_start_position
from identification.simulate.step import choose_steps

H = 1e-3
"""Time between samples [s]."""
LAW = np.array([100.0, 1000.0, 1e-4, 0.5, 2.0, 700.0, 0.0, 2e4, 0.0, 0.0])
"""Yield force of 100 N + 1000 N/V, yield displacement of 0.1 mm."""
HALF = 1e-4
"""Half of a gap [m]."""


def count_steps(v0=0.1, v1=0.1, u0=0.1, u1=0.1, y_rate=0.05, zeta=0.5, zeta_rate=0.0):
    return choose_steps(0.1, LAW, H, v0, v1, u0, u1, y_rate, zeta, zeta_rate)


@pytest.mark.parametrize(
    ("zeta_rate", "steps"), [(0.0, 1), (99.0, 1), (101.0, 2), (-250.0, 2), (-410.0, 3), (2500.0, 5), (1e7, 64)]
)
def test_steps_are_the_root_of_the_travel_over_its_limit(zeta_rate, steps):
    assert count_steps(zeta_rate=zeta_rate) == steps


@pytest.mark.parametrize(
    ("slip", "zeta", "zeta_rate", "steps"),
    [
        # Twice a slip of 0.1 m/s over 0.1 mm: zeta would travel by 2 in a sample.
        (-0.1, 0.5, 0.0, 5),
        (0.1, -0.5, 0.0, 5),
        (-0.1, 0.5, 5000.0, 8),
        (-0.1, -0.5, 0.0, 1),
        (-0.001, 0.5, 0.0, 1),
    ],
)
def test_after_a_reversal_the_travel_is_at_least_that_of_the_slip(slip, zeta, zeta_rate, steps):
    assert count_steps(slip, slip, y_rate=0.0, zeta=zeta, zeta_rate=zeta_rate) == steps


@pytest.mark.parametrize(
    ("v0", "v1", "steps"), [(0.06, 0.04, 4), (0.04, 0.06, 4), (0.06, 0.05, 4), (0.06, 0.051, 1), (0.04, 0.049, 1)]
)
def test_a_sample_in_which_the_slip_reverses_takes_four_steps(v0, v1, steps):
    assert count_steps(v0, v1, y_rate=0.05, zeta=0.0) == steps


def test_a_reversal_with_much_travel_takes_more_than_four_steps():
    assert count_steps(0.1, -0.1, y_rate=0.0) == 5


@pytest.mark.parametrize(("u1", "steps"), [(0.1099, 1), (0.1101, 4), (0.0901, 1), (0.0899, 4)])
def test_the_field_jumps_where_the_yield_force_changes_by_a_twentieth(u1, steps):
    assert count_steps(u1=u1) == steps


@pytest.mark.parametrize(
    ("elongation", "moved", "expected"),
    [
        (-2 * HALF, 0.0, -HALF + 1e-12),
        (-HALF, 2 * HALF, -HALF + 1e-12),
        (2 * HALF, 0.0, HALF - 1e-12),
        (HALF, -2 * HALF, HALF - 1e-12),
        (0.0, 2 * HALF, HALF + 1e-12),
        (0.0, HALF, HALF + 1e-12),
        (0.0, -2 * HALF, -HALF - 1e-12),
        (0.0, 0.5 * HALF, 0.5 * HALF),
        (2 * HALF, 3 * HALF, 3 * HALF),
        (-2 * HALF, -3 * HALF, -3 * HALF),
    ],
)
def test_a_linearisation_goes_at_most_just_beyond_the_next_edge_of_the_gap(elongation, moved, expected):
    assert _choose_elongation(elongation, moved, HALF) == pytest.approx(expected, rel=1e-12, abs=1e-16)


def mounting(compliance=1e-6, gap=0.0, k1=0.0, f0=0.0, film=0.0):
    return np.array([*LAW, k1, f0, compliance, gap, 0.0, film, 0.0])


def inputs(x=0.0, u=0.1, factors=(1.0, 1.0, 1.0), parallel=0.0, v=0.0):
    return np.array([x, u, *factors, parallel, v])


PART = 20000.0 / 20700.0
"""Part of the force of yield and c0 that reaches the load cell: c1 over c0 + c1."""


@pytest.mark.parametrize(
    ("fixed", "at", "expected"),
    [
        # The yield force is 200 N, c0 is 700 N s/m, and 1 N is 1 µm.
        (mounting(), inputs(), -200e-6 * PART),
        (mounting(), inputs(x=1e-3, v=0.1), 1e-3 - 270e-6 * PART),
        (mounting(f0=50.0), inputs(parallel=20.0), -200e-6 * PART + 30e-6),
        (mounting(), inputs(factors=(0.5, 2.0, 1.0), v=0.1), -240e-6 * 20000.0 / 21400.0),
        (mounting(gap=1e-4), inputs(), -200e-6 * PART - 50e-6),
        # X = -(200 PART + 1000 X) / 1e6
        (mounting(k1=1e3), inputs(), -0.2 * PART / 1001.0),
    ],
)
def test_a_compliant_mount_starts_where_the_damper_has_the_velocity_of_the_actuator(fixed, at, expected):
    assert find_start_position(fixed, at, 0.0, 1.0) == pytest.approx(expected, rel=1e-9)


def test_a_spring_of_the_law_pulls_at_the_start_by_its_elongation():
    fixed = mounting()
    fixed[9] = 1e4
    # X = -(200 + 10 000 (X - y0)) PART / 1e6
    assert find_start_position(fixed, inputs(), 1e-3, 1.0) == pytest.approx(-190e-6 * PART / (1.0 + 0.01 * PART))


def test_the_cell_shows_the_spring_and_the_film_of_the_connection():
    force = compute_cell_force(mounting(film=50.0), inputs(x=3e-4, v=0.1), 1e-4, 0.04)
    assert force == pytest.approx(200.0 + 50.0 * 0.06, rel=1e-9)


@pytest.mark.parametrize(("X_rate", "steps"), [(0.06, 4), (0.16, 1)])
def test_on_a_compliant_mount_the_damper_may_reach_the_speed_of_the_actuator_in_a_sample(X_rate, steps):
    at = np.array([inputs(v=0.1), inputs(x=1e-4, v=0.1)]).T.copy()
    assert choose_sample_steps(0.1, mounting(), at, H, 0, X_rate, 0.08, 0.0, 0.0) == steps


def test_a_hardening_mount_at_a_coarse_step_stays_near_the_rigid_one():
    # A stage starts from an elongation that is far too large. Newton's method alone then left the range of zeta,
    # and the force grew to 1e12 N.
    law = Coordinates(
        F_a=70.7e3, F_b=17e3, D_y=2.2e-3, rho=0.98, n=4.1, eta=8.3, c0_a=695e3, c0_b=-15e3, c1_a=4.5e6, c1_b=16e3,
        k0=481e3, k1=174e3, f0=140e3,
    )  # fmt: skip
    w, t = 2.0 * np.pi * 0.25, 0.08 * np.arange(200)
    x, v = 0.1 * np.sin(w * t), 0.1 * w * np.cos(w * t)
    stroke = Excitation(12.5, x, v, -(w**2) * x, np.zeros(len(t)))
    mount = ActiveEffect(EFFECTS["fixture_compliance"], (9.2e-9, 1e6), "stiffening")
    found = simulate(SimulationModel(law, effects=(mount,)), stroke)
    rigid = simulate(SimulationModel(law), stroke)
    assert np.abs(found.zeta).max() < 1.1
    assert (found.force - rigid.force).std() < 0.05 * rigid.force.std()

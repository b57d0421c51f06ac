"""Between load cell and damper: a joint that closes, and a connection whose elongation is a table."""

import numpy as np
import pytest

from identification.damper.effects import EFFECTS
from identification.damper.effects.connection import (
    FORCES,
    compute_elongation,
    compute_tangent_stiffness,
    compute_transmitted_force,
    interpolate_force,
    tabulate_elongation,
)

COMPLIANCE, LOAD, RATIO = 4e-7, 250.0, 2.5
TOUCHING = COMPLIANCE * LOAD
CLOSING = EFFECTS["fixture_compliance"].find_form("closing_joint")


def joint():
    """Give, gap, hardening and stiffness in the gap of a joint that closes."""
    give, gap, hardening, _, inside = CLOSING.function(COMPLIANCE, LOAD, RATIO)
    return give, gap, hardening, inside


def test_it_gives_way_as_said_until_its_faces_touch():
    assert compute_transmitted_force(0.5 * TOUCHING, *joint()) == pytest.approx(
        0.5 * TOUCHING / COMPLIANCE, rel=1e-3
    )
    assert compute_tangent_stiffness(0.5 * TOUCHING, *joint()) == pytest.approx(1.0 / COMPLIANCE, rel=1e-3)


def test_it_is_stiffer_by_the_ratio_from_there_on():
    assert compute_tangent_stiffness(2.0 * TOUCHING, *joint()) == pytest.approx(RATIO / COMPLIANCE)


def test_the_force_does_not_jump_where_they_touch():
    just = 1e-12
    assert compute_transmitted_force(TOUCHING + just, *joint()) == pytest.approx(
        compute_transmitted_force(TOUCHING - just, *joint()), rel=1e-6
    )


@pytest.mark.parametrize("force", [-900.0, -100.0, -1.0, 1.0, 100.0, 249.0, 251.0, 900.0])
def test_the_stretch_under_a_load_carries_that_load(force):
    assert compute_transmitted_force(compute_elongation(force, *joint()), *joint()) == pytest.approx(
        force, rel=1e-3
    )


def test_with_a_ratio_of_one_it_is_the_linear_spring():
    give, gap, hardening, _, inside = CLOSING.function(COMPLIANCE, LOAD, 1.0)
    stretch = np.linspace(-3.0, 3.0, 13) * TOUCHING
    forces = [compute_transmitted_force(s, give, gap, hardening, inside) for s in stretch]
    assert forces == pytest.approx(list(stretch / COMPLIANCE), rel=1e-3)


MIDDLE = len(FORCES) // 2


def test_a_table_keeps_a_growing_elongation_and_its_level():
    elongation = 1e-5 * np.tanh(FORCES / 100.0) + 3e-6
    assert tabulate_elongation(elongation, 1e-20) == pytest.approx(elongation, abs=1e-12)


def test_a_table_grows_by_its_least_slope_where_the_elongation_decreases():
    table = tabulate_elongation(-1e-6 * FORCES, 1e-9)
    assert table == pytest.approx(1e-9 * FORCES, rel=1e-9)
    one_sided = tabulate_elongation(1e-6 * np.maximum(FORCES, 0.0), 1e-9)
    assert one_sided[MIDDLE:] == pytest.approx(1e-6 * FORCES[MIDDLE:])
    assert one_sided[:MIDDLE] == pytest.approx(1e-9 * FORCES[:MIDDLE])


@pytest.mark.parametrize("force", [-2e7, -312.0, -1e-4, 0.0, 0.4, 1000.0, 99_999.0, 2e7])
def test_a_table_transmits_the_force_of_its_elongation(force):
    fixed = np.array([5.0, 7.0])
    table = np.concatenate([fixed, tabulate_elongation(2e-7 * FORCES, 1e-12)])
    found, stiffness = interpolate_force(2e-7 * force, table, len(fixed))
    assert found == pytest.approx(force, rel=1e-6, abs=1e-9)
    assert stiffness == pytest.approx(5e6, rel=1e-6)


def test_a_table_resolves_each_decade_of_the_force_alike():
    curve = 1e-4 * np.tanh(FORCES / 30.0)
    between = np.geomspace(1.0, 300.0, 500)
    found = np.interp(between, FORCES, curve)
    assert np.abs(found - 1e-4 * np.tanh(between / 30.0)).max() < 2e-5 * 1e-4

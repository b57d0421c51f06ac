"""Between load cell and damper: a joint that closes is soft at first, then stiffer, and never jumps."""

import numpy as np
import pytest

from identification.damper.effects import EFFECTS
from identification.damper.effects.connection import (
    compute_elongation,
    compute_tangent_stiffness,
    compute_transmitted_force,
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

"""Effects: forms, slopes and senses."""

import numpy as np
import pytest

from identification.damper.effects import EFFECTS

STAGES = ("coil", "damper", "mounting", "force_channel", "displacement_channel")
FORCES = [e for e in EFFECTS.values() if e.acts == "parallel_force"]
X = np.linspace(-0.012, 0.012, 7)
V = np.linspace(0.11, -0.13, 7)


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=lambda e: e.name)
def test_each_effect_declares_its_place_and_parameters(effect):
    assert effect.stage in STAGES
    assert all(q.low < q.high and q.low <= q.scale <= q.high and q.unit for q in effect.parameters)


@pytest.mark.parametrize("effect", FORCES, ids=lambda e: e.name)
def test_slopes_of_a_force_agree_with_differences(effect):
    point = [X, V, *(q.scale for q in effect.parameters)]
    for i, slope in enumerate(effect.slopes(*point)):
        step = 1e-6 * (np.max(np.abs(point[i])))
        after, before = list(point), list(point)
        after[i], before[i] = point[i] + step, point[i] - step
        difference = (effect.act(*after) - effect.act(*before)) / (2 * step)
        np.testing.assert_allclose(slope, difference, rtol=1e-5, atol=1e-6 * (np.abs(difference).max() + 1e-9))


def test_gas_spring_is_at_rest_in_the_middle_and_stiffens_in_compression():
    force = EFFECTS["gas_spring"].act
    assert force(0.0, 0.0, 90.0, 0.05) == 0.0
    assert -force(-0.01, 0.0, 90.0, 0.05) > force(0.01, 0.0, 90.0, 0.05) > 0


def test_gas_spring_with_both_signs_turned_is_the_recording_turned_round():
    force = EFFECTS["gas_spring"].act
    assert force(0.01, 0.0, -90.0, -0.05) == pytest.approx(-force(-0.01, 0.0, 90.0, 0.05))


def test_friction_dissipates_and_peaks_near_rest():
    force = EFFECTS["seal_friction"].act
    assert force(0.0, 0.003, 20.0, 10.0, 0.015) > force(0.0, 0.2, 20.0, 10.0, 0.015) > 19.9
    assert force(0.0, -0.2, 20.0, 10.0, 0.015) == -force(0.0, 0.2, 20.0, 10.0, 0.015)


def test_backlash_holds_the_damper_until_the_gap_is_crossed():
    follow = EFFECTS["clevis_backlash"].act
    held = follow(0.0, 0.001, 2e-4)
    assert held == pytest.approx(0.0009)
    assert follow(held, 0.00085, 2e-4) == held
    assert follow(held, 0.0007, 2e-4) == pytest.approx(0.0008)


@pytest.mark.parametrize(
    ("x", "slopes"), [(0.001, (0.0, 1.0, -0.5)), (0.0, (1.0, 0.0, 0.0)), (-0.001, (0.0, 1.0, 0.5))]
)
def test_backlash_slopes_say_which_side_pushes(x, slopes):
    assert EFFECTS["clevis_backlash"].slopes(0.0, x, 2e-4) == slopes


def test_delay_looks_back():
    assert EFFECTS["force_delay"].act(1.0, 0.004) == pytest.approx(0.996)
    assert EFFECTS["force_delay"].slopes(1.0, 0.004) == (1.0, -1.0)

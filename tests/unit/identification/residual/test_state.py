"""State of the damper on which a residual depends."""

from dataclasses import replace

import numpy as np
import pytest

from identification.residual.state import VARIABLES, StateUnits, compute_state
from identification.simulate import Excitation
from tests.support.strokes import sine

UNITS = StateUnits(500.0, 0.01, 0.002, 0.1, 0.1, 0.6)


def make_excitation(size=1.0, centre=0.002, drive=0.35, time=1.0):
    x, v = sine(0.01 * size, 2.0 / time, 2.0 * time, 1000.0 / time)
    a = -((2 * np.pi * 2.0 / time) ** 2) * x
    return Excitation(1000.0 / time, x + centre, v, a, np.full(len(x), drive))


def test_the_state_has_all_variables_without_units():
    state = compute_state(make_excitation(), np.full(2000, 250.0), UNITS)
    assert tuple(state) == VARIABLES
    assert state["drive"] == pytest.approx(1.0)
    assert state["law_force"] == pytest.approx(0.5)
    assert np.ptp(state["displacement"]) == pytest.approx(4.0, rel=1e-3)
    assert state["displacement"].mean() == pytest.approx(0.0, abs=1e-9)


def test_the_travel_starts_at_each_reversal_and_has_the_sign_of_the_velocity():
    excitation = make_excitation()
    travel = np.sinh(compute_state(excitation, np.zeros(2000), UNITS)["travel_since_reversal"]) * 0.01 * 0.01
    x = excitation.displacement
    # The second reversal is at three quarters of the first cycle, 0.375 s. The deadband is 10 um to either side.
    assert travel[450] == pytest.approx(x[450] - x.min(), abs=2.1e-5)
    assert travel[624] == pytest.approx(0.02, abs=2.1e-5)
    assert travel[650] < 0.0


def test_the_recent_speed_tells_rest_from_a_reversal():
    moving = make_excitation()
    stopped = np.arange(2000) >= 1000
    velocity = np.where(stopped, 0.0, moving.velocity)
    excitation = replace(moving, velocity=velocity)
    speed = np.sinh(compute_state(excitation, np.zeros(2000), UNITS)["recent_speed"]) * 0.03 * UNITS.velocity
    reversal = int(np.argmin(np.abs(moving.velocity[500:900]))) + 500
    mean = np.abs(moving.velocity[:1000]).mean()
    assert speed[reversal] == pytest.approx(mean, rel=0.3)
    assert speed[0] == pytest.approx(mean, rel=0.3)
    # Half the stroke lasts 0.1 s at the peak speed, and the speed is forgotten within 0.2 s.
    assert speed[1200] == pytest.approx(speed[1000] * np.exp(-1.0), rel=0.02)
    assert speed[-1] < 0.02 * mean


def test_a_change_follows_its_signal_and_is_forgotten_in_a_tenth_of_half_a_stroke():
    excitation = make_excitation()
    law = np.where(np.arange(2000) >= 1000, 300.0, 100.0)
    change = compute_state(excitation, law, UNITS)["force_change"] * 0.25 * UNITS.force
    assert change[:1000] == pytest.approx(0.0, abs=1e-9)
    # Half the stroke lasts 0.1 s at the peak speed, so the time constant is ten samples.
    assert change[1000] == pytest.approx(200.0 * 10.0 / 11.0)
    assert change[1010] == pytest.approx(change[1000] * np.exp(-1.0), rel=0.06)
    velocity = np.sinh(compute_state(excitation, law, UNITS)["velocity_change"]) * 0.03 * UNITS.velocity
    settled = slice(100, 1900)
    assert velocity[settled] == pytest.approx(0.01 * excitation.acceleration[settled], abs=0.15 * UNITS.velocity)
    assert np.ptp(velocity[settled]) > 0.2 * UNITS.velocity


def test_dampers_of_different_size_and_speed_have_the_same_state():
    law = np.linspace(-400.0, 400.0, 2000)
    small = compute_state(make_excitation(), law, UNITS)
    units = StateUnits(5e4, 0.1, 0.02, 0.5, 1.0, 6.0)
    large = compute_state(make_excitation(10.0, 0.02, 3.5, 2.0), 100.0 * law, units)
    for name in VARIABLES:
        assert large[name] == pytest.approx(small[name], abs=1e-6), name

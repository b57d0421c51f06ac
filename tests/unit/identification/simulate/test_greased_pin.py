"""Play with grease in it: after a reversal the force halts at what the film carries, for the way of the gap."""

import numpy as np
import pytest

from identification.damper.effects import EFFECTS
from identification.simulate import ActiveEffect, Excitation, SimulationModel, simulate
from tests.support.effects import LABORATORY

RATE, GAP, FILM, DRIVE = 2000.0, 1e-3, 4000.0, 0.5
POINT = LABORATORY._replace(k0=0.0, k1=0.0, f0=0.0)


def there_and_back(speed):
    """Two centimetres in, then out again, at one speed [m/s]; turns within a millisecond."""
    t = np.arange(round(0.04 / speed * RATE)) / RATE
    velocity = speed * np.tanh((t - 0.02 / speed) / 1e-3)
    x = np.cumsum(velocity) / RATE
    return Excitation(RATE, x, velocity, np.gradient(velocity) * RATE, np.full(len(t), DRIVE))


def way_and_force(speed):
    """Way since the reversal [m], and the force [N]."""
    stroke = there_and_back(speed)
    effect = ActiveEffect(EFFECTS["clevis_backlash"], (GAP, 1e-4, FILM), "greased_pin")
    force = simulate(SimulationModel(POINT, effects=(effect,)), stroke).force
    turn = int(np.argmin(stroke.displacement))
    return stroke.displacement[turn:] - stroke.displacement[turn], force[turn:]


@pytest.mark.parametrize("speed", [0.01, 0.03])
def test_inside_the_gap_the_force_is_that_of_the_film_in_series_with_the_dashpot(speed):
    way, force = way_and_force(speed)
    inside = (way > 0.4 * GAP) & (way < 0.9 * GAP)
    dashpot = POINT.c1_a + POINT.c1_b * DRIVE
    assert force[inside] == pytest.approx(speed / (1.0 / FILM + 1.0 / dashpot), rel=0.02)


@pytest.mark.parametrize("speed", [0.01, 0.03])
def test_behind_the_gap_the_damper_resists_as_ever(speed):
    way, force = way_and_force(speed)
    beyond = force[way > 2.0 * GAP]
    plain = simulate(SimulationModel(POINT), there_and_back(speed)).force[-len(beyond) :]
    assert beyond == pytest.approx(plain, rel=1e-2)
    assert beyond.min() > 2.0 * FILM * speed

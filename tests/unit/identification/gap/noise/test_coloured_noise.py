"""Noise may have any spectrum; bursts, beats, drift and repeating parts are not noise."""

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.signal import lfilter

from identification.gap.data.cycles import Cycles, StrokeCondition
from identification.gap.data.residual_map import Residual
from identification.gap.noise.coloured_noise import estimate_coloured_floor, is_stationary

RATE = 1000.0
SECONDS = 60
COUNT = round(RATE * SECONDS)
TIME = np.arange(COUNT) / RATE
CYCLES = Cycles(
    cycle=(2.0 * TIME).astype(int),
    phase=(2.0 * TIME) % 1.0,
    segment=np.arange(2 * SECONDS) // 20,
    conditions=tuple(StrokeCondition(0.2, 0.01, 2.0) for _ in range(6)),
)


def make_noise(seed=1, slow=1.2):
    """White noise of 2 N and slow noise with a correlation time of 50 ms."""
    random = default_rng(seed)
    decay = np.exp(-1.0 / (RATE * 0.05))
    shocks = slow * np.sqrt(1.0 - decay**2) * random.standard_normal(COUNT)
    return 2.0 * random.standard_normal(COUNT) + lfilter([1.0], [1.0, -decay], shocks)


def make_residual(values):
    drive = np.full(COUNT, 0.2)
    return Residual(values, np.zeros(COUNT), drive, TIME, np.ones(COUNT, bool), ((COUNT, RATE),))


@pytest.mark.parametrize("seed", range(1, 6))
def test_coloured_noise_is_estimated_completely(seed):
    assert estimate_coloured_floor(make_residual(make_noise(seed)), CYCLES) == pytest.approx(
        np.hypot(2.0, 1.2), rel=0.03
    )


def test_the_repeating_part_of_a_residual_is_not_noise():
    locked = 3.0 * np.sin(2.0 * np.pi * CYCLES.phase) ** 3
    floor = estimate_coloured_floor(make_residual(make_noise() + locked), CYCLES)
    assert floor is None or floor == pytest.approx(np.hypot(2.0, 1.2), rel=0.05)


@pytest.mark.parametrize(
    "disturbance",
    [
        4.0 * np.exp(-5.0 * (1.0 - np.cos(2.0 * np.pi * TIME / 4.0))) * np.sin(2.0 * np.pi * 11.0 * TIME),
        2.0 * np.sin(2.0 * np.pi * 8.3 * TIME),
        3.0 * (1.0 - np.exp(-TIME / 20.0)),
        8.0 * (TIME % 9.0 < 0.3),
    ],
    ids=["bursts", "beat", "drift", "sticking"],
)
def test_a_disturbance_is_not_stationary_noise(disturbance):
    assert not is_stationary(make_residual(make_noise(slow=0.0) + disturbance))

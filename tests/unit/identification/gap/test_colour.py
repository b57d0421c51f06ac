"""Noise may be of any colour, but what bursts, beats, drifts or repeats with the stroke is none."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.signal import lfilter

from identification.gap.colour import floor_under, steady
from identification.gap.hearing import Hearing
from identification.gap.residual import Condition, Cycles
from identification.gap.where import Left

RATE = 1000.0
SECONDS = 60
COUNT = round(RATE * SECONDS)
TIME = np.arange(COUNT) / RATE
CYCLES = Cycles(
    cycle=(2.0 * TIME).astype(int),
    phase=(2.0 * TIME) % 1.0,
    segment=np.arange(2 * SECONDS) // 20,
    conditions=tuple(Condition(0.2, 0.01, 2.0) for _ in range(6)),
)


def coloured(seed=1, slow=1.2):
    """White noise of 2 N and a slow one with 50 ms of memory."""
    chance = default_rng(seed)
    keep = np.exp(-1.0 / (RATE * 0.05))
    shocks = slow * np.sqrt(1.0 - keep**2) * chance.standard_normal(COUNT)
    return 2.0 * chance.standard_normal(COUNT) + lfilter([1.0], [1.0, -keep], shocks)


def left(residual):
    drive = np.full(COUNT, 0.2)
    return Left(residual, np.zeros(COUNT), drive, TIME, np.ones(COUNT, bool), ((COUNT, RATE),))


@pytest.mark.parametrize("seed", range(1, 6))
def test_coloured_noise_is_heard_in_its_whole_size(seed):
    assert floor_under(left(coloured(seed)), CYCLES) == pytest.approx(np.hypot(2.0, 1.2), rel=0.03)


def test_what_repeats_with_the_stroke_is_not_counted():
    locked = 3.0 * np.sin(2.0 * np.pi * CYCLES.phase) ** 3
    heard = floor_under(left(coloured() + locked), CYCLES)
    assert heard is None or heard == pytest.approx(np.hypot(2.0, 1.2), rel=0.05)


@pytest.mark.parametrize(
    "strange",
    [
        4.0 * np.exp(-5.0 * (1.0 - np.cos(2.0 * np.pi * TIME / 4.0))) * np.sin(2.0 * np.pi * 11.0 * TIME),
        2.0 * np.sin(2.0 * np.pi * 8.3 * TIME),
        3.0 * (1.0 - np.exp(-TIME / 20.0)),
        8.0 * (TIME % 9.0 < 0.3),
    ],
    ids=["bursts", "beat", "drift", "sticking"],
)
def test_what_is_no_noise_is_not_taken_for_it(strange):
    assert not steady(left(coloured(slow=0.0) + strange))


@pytest.mark.parametrize(("heard", "rest", "noise"), [(2.4, 2.2, 2.2), (2.4, 2.6, 2.4), (2.4, 1.5, 2.0)])
def test_what_was_heard_is_no_more_than_a_set_leaves_and_no_less_than_white(heard, rest, noise):
    hearing = Hearing(2.0, ())
    hearing.noise, hearing.carried = heard, 0.3
    contender = SimpleNamespace(left=left(np.full(COUNT, np.hypot(rest, 0.3))))
    assert hearing.noise_under(contender) == pytest.approx(noise)

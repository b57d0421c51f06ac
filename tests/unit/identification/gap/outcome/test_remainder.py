"""Part of a gap that the named effects leave, and the variables that it depends on."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.random import default_rng

from identification.gap.data.cycles import Cycles, StrokeCondition
from identification.gap.data.residual_map import Residual
from identification.gap.noise.explainable_share import ResidualRegression
from identification.gap.outcome.remainder import describe_remainder, estimate_not_repeating
from tests.support.candidate_pools import make_pool

FLOOR, CYCLES, SAMPLES = 1.0, 8, 400
COUNT = CYCLES * SAMPLES
PHASE = np.tile(np.arange(SAMPLES) / SAMPLES, CYCLES)
CYCLE = np.repeat(np.arange(CYCLES), SAMPLES)


def estimate(values, frequency=2.0, cycle=CYCLE, usable=None):
    ones = np.ones(COUNT)
    residual = Residual(values, ones, ones, np.arange(COUNT) / 800.0, ones > 0, ((COUNT, 800.0),))
    cycles = Cycles(cycle, PHASE, np.zeros(cycle.max() + 1, int), (StrokeCondition(1.0, 0.01, frequency),))
    evaluation = SimpleNamespace(cycles=cycles, usable=ones > 0 if usable is None else usable)
    return estimate_not_repeating(residual, evaluation, FLOOR)


NOISE = FLOOR * default_rng(1).standard_normal(COUNT)
REPEATED = 3.0 * np.sin(2 * np.pi * PHASE)
CHANGING = 3.0 * np.sin(2 * np.pi * PHASE) * np.sqrt(2.0) * np.sin(2 * np.pi * np.arange(CYCLES) / CYCLES)[CYCLE]


@pytest.mark.parametrize(
    ("values", "share"), [(REPEATED, 0.0), (CHANGING, 1.0), ((REPEATED + CHANGING) / np.sqrt(2.0), 0.5)]
)
def test_the_share_that_does_not_repeat_is_that_of_the_variance_beyond_the_noise(values, share):
    # The mean of eight cycles also contains an eighth of what does not repeat, which the factor 8 / 7 returns.
    assert estimate(values + NOISE) == pytest.approx(share, abs=0.06 if share < 1.0 else 0.15)


def test_without_a_second_cycle_there_is_no_share():
    assert estimate(REPEATED + NOISE, frequency=0.0) is None
    assert estimate(REPEATED + NOISE, cycle=np.zeros(COUNT, int)) is None
    broken = (np.arange(COUNT) % SAMPLES > 0) | (CYCLE == 0)
    assert estimate(REPEATED + NOISE, usable=broken) is None
    assert estimate(0.5 * NOISE) is None


def test_the_remainder_of_a_law_without_its_gas_spring_depends_on_the_displacement():
    pool = make_pool("gas_spring")
    baseline = pool.fit_law()
    regression = ResidualRegression(pool.evaluation, pool.floor)
    remainder = describe_remainder(pool, baseline, regression, pool.floor)
    assert remainder.gap_n == pytest.approx(np.sqrt(baseline.held_out_rmse**2 - pool.floor**2))
    assert remainder.explainable > 0.5
    assert "displacement" in remainder.variables
    assert remainder.stage == "damper"
    assert remainder.map[0].gap_n >= remainder.map[-1].gap_n


def test_nothing_remains_at_the_noise_floor():
    pool = make_pool()
    baseline = pool.fit_law()
    regression = ResidualRegression(pool.evaluation, pool.floor)
    assert describe_remainder(pool, baseline, regression, 1.05 * baseline.held_out_rmse) is None
    assert regression.explain(baseline).share == 0.0 or baseline.held_out_rmse > 1.02 * pool.floor

"""Part of a residual that repeats from cycle to cycle."""

import numpy as np
import pytest

from identification.gap.data import Cycles, Residual, estimate_repeated_residual
from identification.gap.data.cycles import StrokeCondition

RATE, SEGMENTS, CYCLES, PERIOD = 1000.0, 6, 8, 500


def make_cycles(count=CYCLES, start=130):
    """Cycles of some segments, each of which begins at the same instant of its stroke."""
    samples = SEGMENTS * count * PERIOD
    number = np.arange(samples)
    conditions = tuple(StrokeCondition(0.1 * k, 0.01, RATE / PERIOD) for k in range(SEGMENTS))
    phase = ((number + start) / PERIOD) % 1.0
    return Cycles(number // PERIOD, phase, np.repeat(np.arange(SEGMENTS), count), conditions)


def make_residual(values, valid=None):
    zero = np.zeros(len(values))
    usable = np.ones(len(values), bool) if valid is None else valid
    return Residual(values, zero, zero, np.arange(len(values)) / RATE, usable, ((len(values), RATE),))


def draw_noise(cycles, seed, slowness=0.0):
    """Noise of unit deviation; each sample keeps a part of the one before."""
    white = np.random.default_rng(seed).standard_normal(len(cycles.cycle))
    noise = white.copy()
    for k in range(1, len(noise)):
        noise[k] = slowness * noise[k - 1] + np.sqrt(1.0 - slowness**2) * white[k]
    return noise


@pytest.mark.parametrize("slowness", [0.0, 0.95, 0.999])
def test_noise_of_any_spectrum_does_not_repeat(slowness):
    cycles = make_cycles()
    found = [
        estimate_repeated_residual(make_residual(draw_noise(cycles, seed, slowness)), cycles) for seed in range(8)
    ]
    distances = [r.square / r.deviation for r in found]
    assert max(map(abs, distances)) < 4.0
    assert np.std(distances) == pytest.approx(1.0, abs=0.6)
    assert all(r.lowest < 0.0 for r in found)


def test_a_small_error_that_repeats_is_measured_in_slow_noise():
    cycles = make_cycles()
    error = 0.6 * np.sin(4.0 * np.pi * cycles.phase)
    found = estimate_repeated_residual(make_residual(draw_noise(cycles, 3, 0.95) + error), cycles)
    assert found.square == pytest.approx(np.mean(error**2), abs=3 * found.deviation)
    assert found.lowest > 0.0


def test_an_error_in_one_cycle_does_not_repeat():
    cycles = make_cycles()
    error = np.where(cycles.cycle % CYCLES == 0, np.sin(4.0 * np.pi * cycles.phase), 0.0)
    found = estimate_repeated_residual(make_residual(draw_noise(cycles, 3) + error), cycles)
    assert found.lowest < 0.0


def test_cycles_with_a_part_that_was_not_measured_are_left_out():
    cycles = make_cycles()
    values = draw_noise(cycles, 5)
    missing = (cycles.cycle % CYCLES == 2) & (cycles.phase > 0.5)
    found = estimate_repeated_residual(make_residual(np.where(missing, 1e3, values), ~missing), cycles)
    assert abs(found.square) < 4.0 * found.deviation


def test_too_few_cycles_show_nothing():
    cycles = make_cycles(count=3)
    assert estimate_repeated_residual(make_residual(draw_noise(cycles, 1)), cycles) is None

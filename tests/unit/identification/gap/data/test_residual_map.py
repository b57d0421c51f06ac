"""The gap by stroke condition and phase, its harmonics and its drift."""

import numpy as np
import pytest
from numpy.random import default_rng

from identification.gap.data.residual_map import Residual, compute_harmonics, estimate_drift, map_gap
from tests.unit.identification.gap.data.test_cycles import record

NOISE = 2.0


def make_residual(recorded, values, simulated=None):
    return Residual(
        values,
        np.sin(np.arange(len(values))) if simulated is None else simulated,
        recorded.drive,
        recorded.time,
        np.ones(len(values), bool),
        ((len(values), recorded.rate),),
    )


def test_the_map_locates_the_gap_by_drive_and_phase_without_the_noise():
    recorded, cycles = record()
    bump = 10.0 * ((recorded.drive > 0.3) & (np.abs(cycles.phase - 0.25) < 0.06))
    values = bump + NOISE * default_rng(0).standard_normal(len(bump))
    entries = map_gap(make_residual(recorded, values), cycles, NOISE)
    assert entries[0].drive == pytest.approx(0.4)
    assert abs(entries[0].phase - 0.25) < 0.1
    assert entries[0].gap_n > 5.0
    assert all(entry.gap_n < 1.0 for entry in entries if entry.drive < 0.3)


def test_harmonics_are_separated_by_their_order():
    recorded, cycles = record()
    values = 4.0 * np.sqrt(2.0) * np.cos(3 * 2 * np.pi * cycles.phase)
    rms = {h.order: h.rms_n for h in compute_harmonics(make_residual(recorded, values), cycles)}
    assert rms[3] == pytest.approx(4.0, rel=0.02)
    assert rms[2] < 0.1


@pytest.fixture(scope="module")
def drifting():
    recorded, cycles = record(segments=20)
    noise = NOISE * default_rng(1).standard_normal(len(recorded.time))

    def estimate(values, force=None):
        return estimate_drift(make_residual(recorded, values(recorded.time) + noise, force), cycles)

    return recorded.time, estimate


def test_a_rising_mean_has_a_slope_and_no_line(drifting):
    _, estimate = drifting
    drift = estimate(lambda time: 0.5 * time)
    assert drift.slope_n_per_s == pytest.approx(0.5, rel=0.05)
    assert drift.line_hz is None


def test_a_fading_force_changes_its_size(drifting):
    time, estimate = drifting
    force = 300.0 * np.sin(2 * np.pi * 2.0 * time)
    assert estimate(lambda t: -0.1 * force * t / t[-1], force).size_change == pytest.approx(-0.1, rel=0.1)


def test_a_line_is_reported_with_frequency_and_amplitude(drifting):
    _, estimate = drifting
    drift = estimate(lambda time: 3.0 * np.sin(2 * np.pi * 50.3 * time))
    assert drift.line_hz == pytest.approx(50.3, abs=0.1)
    assert drift.line_n == pytest.approx(3.0, rel=0.1)

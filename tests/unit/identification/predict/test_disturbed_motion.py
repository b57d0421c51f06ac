"""Prediction of a recording in which no cycle repeats the motion of another."""

from dataclasses import replace

import numpy as np
import pytest

from identification.fitting import DamperModel, HoldOut, assemble, dataset
from identification.noise import estimate_floor
from identification.predict.predict import predict_log
from identification.simulate import Excitation, SimulationModel, simulate
from tests.support.laboratory import LABORATORY, MOTION_NOISE, NOISE, RATE, recording, stretch


def record_late_setpoints(seed: int, lateness: float):
    """Return a recording whose setpoints are late by another time [s] in each tenth of a second."""
    planned, random = stretch("late", 0.010, 1.0, seed), np.random.default_rng(seed)
    steps = np.repeat(random.uniform(-lateness, lateness, len(planned.time) // 100), 100)
    late = np.convolve(steps, np.hanning(61) / np.hanning(61).sum(), "same")
    x = 0.010 * np.sin(2 * np.pi * (planned.time + late))
    velocity = np.gradient(x) * RATE
    motion = Excitation(RATE, x, velocity, np.gradient(velocity) * RATE, planned.drive)
    force = simulate(SimulationModel(LABORATORY), motion, max_travel=0.005).force
    noise = random.standard_normal((2, len(x)))
    return recording(replace(planned, displacement=x + MOTION_NOISE * noise[0], force=force + NOISE * noise[1]))


@pytest.mark.parametrize(("seed", "lateness"), [(31, 0.02), (37, 0.03), (33, 0.04)])
def test_the_floor_of_strokes_that_do_not_repeat_is_the_noise(seed, lateness):
    log = record_late_setpoints(seed, lateness)
    prediction, _ = predict_log(DamperModel(LABORATORY), log)
    assert assemble([log], HoldOut()).floor.noise == pytest.approx(NOISE, rel=0.1)
    assert prediction.noise_floor_n <= prediction.rmse_n == pytest.approx(NOISE, rel=0.15)


def test_the_floor_is_at_most_the_error_of_a_model_on_unseen_strokes(monkeypatch):
    """An estimate that is too high by a third does not exceed what a model leaves."""

    def estimate_too_high(*given):
        floor = estimate_floor(*given)
        return replace(floor, noise=1.33 * floor.noise)

    monkeypatch.setattr(dataset, "estimate_floor", estimate_too_high)
    prediction, _ = predict_log(DamperModel(LABORATORY), record_late_setpoints(31, 0.02))
    assert prediction.noise_floor_n == prediction.rmse_n == pytest.approx(NOISE, rel=0.15)

"""The noise model is updated from candidates, in their order."""

from dataclasses import replace

import numpy as np
import pytest

from identification.gap.data import ErrorSquare, Residual
from identification.gap.fits import Candidate
from identification.gap.noise import noise_model
from identification.gap.noise.noise_model import NoiseModel
from identification.noise import NoiseFloorEstimate, ScaleVariance, SlowVariance
from tests.support.candidate_pools import NOISE, fit_baseline
from tests.support.effects import active
from tests.support.noise import make_pink_noise

BACKLASH = frozenset({"clevis_backlash"})


@pytest.fixture(scope="module")
def pool():
    """A free pin, with the law alone and with the true effect."""
    pool = fit_baseline(active("clevis_backlash", "free_pin"))
    pool.extend("clevis_backlash")
    return pool


def make_model(pool, *names):
    """A noise model after updates with some candidates."""
    model = NoiseModel(pool.noise_model.estimate, pool.noise_model.stretches)
    for name in names:
        model.update(pool.candidates[name], pool.problems.full, pool.evaluation)
    return model


def test_the_first_update_adds_the_input_noise_of_the_law(pool):
    model = make_model(pool, frozenset())
    assert 0.0 < model.input_noise < NOISE
    assert model.floor == pytest.approx(np.hypot(model.noise, model.input_noise))
    assert make_model(pool).input_noise is None


def test_later_updates_never_raise_the_input_noise(pool):
    first = make_model(pool, frozenset()).input_noise
    then = make_model(pool, frozenset(), BACKLASH).input_noise
    assert then <= first
    assert make_model(pool, frozenset(), BACKLASH, frozenset()).input_noise == then


def test_a_candidate_at_the_floor_changes_nothing(pool):
    candidate = pool.candidates[BACKLASH]
    at_floor = replace(candidate, train_rmse=0.5 * NOISE, held_out_rmse=0.5 * NOISE)
    model = make_model(pool)
    model.update(at_floor, pool.problems.full, pool.evaluation)
    assert model.input_noise is None


def test_motions_are_drawn_for_the_first_candidate_and_reused(pool):
    model = make_model(pool, frozenset())
    runs = model.sample_other_runs(pool.candidates[BACKLASH], pool.problems.full)
    assert runs.shape == (8, len(pool.evaluation.force))
    first_two = runs[:2][:, pool.evaluation.fitted_samples]
    updated = make_model(pool, frozenset(), BACKLASH).input_noise
    assert min(np.sqrt(first_two.mean()), model.input_noise) == pytest.approx(updated)


@pytest.mark.parametrize(("estimate", "remaining", "noise"), [(2.4, 2.2, 2.2), (2.4, 2.6, 2.4), (2.4, 1.5, 2.0)])
def test_the_noise_lies_between_white_noise_and_the_residual(pool, estimate, remaining, noise):
    model = NoiseModel(NoiseFloorEstimate(estimate, estimate, 2.0, "coloured", 0.1), (), input_noise=0.3)
    residual = pool.baseline.residual
    values = np.full(len(residual.values), np.hypot(remaining, 0.3))
    candidate = Candidate(pool.baseline.fit, replace(residual, values=values), 0.0, 0.0, 0.0)
    assert model.estimate_noise(candidate) == pytest.approx(noise)


@pytest.mark.parametrize(
    ("remaining", "deviation", "disproved"), [(2.6, 0.1, True), (2.8, 0.1, False), (1.0, None, False)]
)
def test_a_set_disproves_a_floor_that_is_above_its_error_by_more_than_chance(
    pool, remaining, deviation, disproved
):
    model = NoiseModel(NoiseFloorEstimate(3.0, 3.0, 2.0, "coloured", deviation), ())
    found = replace(pool.candidates[BACKLASH], train_rmse=remaining, held_out_rmse=remaining)
    assert model.is_disproved_by(found) is disproved
    assert not model.is_disproved_by(replace(pool.baseline, train_rmse=remaining, held_out_rmse=remaining))


@pytest.mark.parametrize(("recorded", "floor"), [(1.5, 1.5), (9.0, NOISE)])
def test_a_disproved_floor_becomes_the_noise_at_high_frequencies_without_lines(pool, recorded, floor):
    model = NoiseModel(NoiseFloorEstimate(12.0, 12.0, recorded, "coloured", 0.1), ())
    model.discard_cycles(pool.candidates[BACKLASH])
    assert model.floor == pytest.approx(floor, rel=0.1)
    assert model.has_unsteady_cycles
    assert model.estimate.deviation is None


def test_the_highest_floor_is_the_upper_end_of_the_interval_with_the_input_noise():
    known = NoiseModel(NoiseFloorEstimate(3.0, 3.0, 2.0, "coloured", 0.1), ())
    assert known.highest_floor == pytest.approx(3.196)
    assert replace(known, input_noise=1.0).highest_floor == pytest.approx(np.hypot(3.196, 1.0))
    unknown = NoiseModel(NoiseFloorEstimate(2.0, None, 2.0, "high frequency"), ())
    assert unknown.highest_floor == 2.0


def test_noise_hardly_exceeds_its_floor_by_the_chance_of_some_samples():
    model = NoiseModel(NoiseFloorEstimate(2.0, 2.0, 2.0, "", 0.0), (), input_noise=1.0)
    assert model.compute_highest_rmse(1800) ** 2 == pytest.approx(5.0 + 3.0 * 4.0 / 30.0)
    slow = replace(model.estimate, scales=(ScaleVariance(1, 0.1, 0.0), ScaleVariance(64, 3.9, 0.0)))
    assert replace(model, estimate=slow).compute_highest_rmse(1800) > 1.1 * model.compute_highest_rmse(1800)
    assert replace(model, has_certain_error=True).compute_highest_rmse(1800) == pytest.approx(np.sqrt(5.0))


def test_the_uncertainty_of_the_floor_adds_to_the_chance():
    model = NoiseModel(NoiseFloorEstimate(2.0, 2.0, 2.0, "", 0.1), ())
    uncertain = 3.0 / 1.96 * (2.196**2 - 4.0)
    assert model.compute_highest_rmse(1800) ** 2 == pytest.approx(4.0 + np.hypot(uncertain, 0.4))


def test_a_residual_that_is_noise_has_the_scales_of_the_force_noise_alone(pool):
    residual = pool.baseline.residual
    with_input = make_model(pool)
    with_input.input_noise = 0.5 * float(np.sqrt(np.mean(residual.values[residual.valid] ** 2)))
    plain, found = (model.describe_residual(pool.baseline) for model in (make_model(pool), with_input))
    assert found.noise == pytest.approx(np.sqrt(0.75) * plain.noise, rel=1e-3)
    for own, whole in zip(found.scales, plain.scales, strict=True):
        assert own == pytest.approx(whole.multiply(0.75), rel=2e-3)


def test_an_error_beyond_the_noise_at_its_scale_is_no_noise(pool, monkeypatch):
    residual = pool.baseline.residual
    square = float(np.mean(residual.values[residual.valid] ** 2))
    monkeypatch.setattr(noise_model, "estimate_repeated_residual", lambda residual, cycles: None)
    monkeypatch.setattr(
        noise_model, "estimate_scale_excess", lambda *given: ErrorSquare(0.19 * square, 0.01 * square)
    )
    model = make_model(pool)
    model.estimate = NoiseFloorEstimate(0.95 * square**0.5, None, NOISE, "", 0.1 * square**0.5)
    model.narrow_floor(pool.baseline, pool.evaluation)
    assert model.noise == pytest.approx(0.9 * square**0.5)
    assert model.has_certain_error


@pytest.fixture
def narrow(pool, monkeypatch):
    """Narrow a floor [N] of a deviation [N] for a part [1] of the law's mean square that repeats."""

    def narrow(noise, deviation, part, part_deviation=0.0):
        square = float(np.mean(pool.baseline.residual.values[pool.baseline.residual.valid] ** 2))
        repeated = ErrorSquare(part * square, part_deviation * square)
        monkeypatch.setattr(noise_model, "estimate_repeated_residual", lambda residual, cycles: repeated)
        model = make_model(pool)
        model.estimate = NoiseFloorEstimate(noise * square**0.5, None, NOISE, "", deviation * square**0.5)
        model.narrow_floor(pool.baseline, pool.evaluation)
        return model.noise / square**0.5, model.estimate.deviation / square**0.5

    return narrow


def test_a_residual_that_repeats_is_no_noise(narrow):
    found, deviation = narrow(0.95, 0.1, 0.19, 0.01)
    assert found == pytest.approx(0.9)
    assert deviation == pytest.approx(0.5 * 0.01 / 0.9)


def test_a_floor_that_excludes_the_rest_of_the_residual_stays(narrow):
    assert narrow(0.5, 0.1, 0.19, 0.01) == pytest.approx((0.5, 0.1))


def test_a_residual_that_repeats_by_chance_is_noise(narrow):
    assert narrow(0.95, 0.1, 0.19, 0.05) == pytest.approx((0.95, 0.1))
    assert narrow(0.95, 0.1, 0.01, 0.0) == pytest.approx((0.95, 0.1))


def test_without_cycles_to_compare_the_floor_stays(pool):
    model = make_model(pool)
    before = model.estimate
    model.narrow_floor(pool.baseline, pool.evaluation)
    assert model.estimate is before


def make_slow_residual(size, rates=((8000, 1000.0),)):
    """A residual of white noise, and of noise with the variance ``size``² in each factor e of the frequency."""
    random, count = np.random.default_rng(5), sum(n for n, _ in rates)
    slow = make_pink_noise(count, random)
    values = random.standard_normal(count) + size * slow * np.sqrt(np.log(count))
    zero = np.zeros(count)
    return Residual(values, zero, zero, zero, np.ones(count, bool), rates)


@pytest.mark.parametrize(
    ("known", "slow", "lowest", "highest"),
    [
        (SlowVariance(0.1, 0.05), 1.0, 0.19, 0.2),
        (SlowVariance(0.1, 9.0), 1.0, 0.5, 3.0),
        (SlowVariance(0.1, 9.0), 0.0, 0.0, 0.01),
        (None, 1.0, 0.5, 3.0),
    ],
    ids=["few cycles show it", "the residual shows more noise", "the residual is white", "no floor is known"],
)
def test_slow_noise_is_bounded_by_repeated_cycles_and_by_the_residual(known, slow, lowest, highest):
    estimate = NoiseFloorEstimate(2.0, None, 1.0, "", None if known is None else 0.1)
    if known is not None:
        estimate = replace(estimate, slow_variance=known)
    found = NoiseModel(estimate, []).bound_slow_variance(make_slow_residual(slow))
    assert lowest <= found <= highest


def test_slow_noise_has_no_bound_from_a_residual_of_several_rates():
    residual = make_slow_residual(1.0, ((4000, 1000.0), (4000, 500.0)))
    assert NoiseModel(NoiseFloorEstimate(2.0, None, 1.0, ""), []).bound_slow_variance(residual) == 0.0

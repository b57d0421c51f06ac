"""Where no cycles repeat, the floor is the residual that no function of stroke, drive and time predicts."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identification.gap.fits import Candidate
from identification.gap.noise import ResidualRegression, discard_unsteady_cycles, take_floor_from_residual
from identification.gap.noise.noise_model import NoiseModel
from identification.gap.noise.unpredicted_residual import (
    CHANCE_DEVIATIONS,
    _is_adequate,
    compare_scatter,
    compare_with_drive,
)
from identification.noise import ScaleVariance, measure_scale_variance
from tests.support.candidate_pools import NOISE, RATE, fit_baseline
from tests.support.noise import make_pink_noise, make_residual

BOUND = 0.7 * NOISE
"""Noise at high frequencies, where the noise is slow."""
RUNS = 8
"""Runs of the noise of the displacement."""


@pytest.fixture(scope="module")
def pool():
    return fit_baseline()


class NamedCandidate(Candidate):
    """A candidate whose effects are stated."""

    stated: frozenset[str] = frozenset()

    @property
    def names(self):
        return self.stated


def make_candidate(pool, values, *names):
    """The law with a stated residual, as if some effects were fitted."""
    residual = replace(pool.baseline.residual, values=np.asarray(values))
    candidate = NamedCandidate(replace(pool.baseline.fit), residual, *pool.evaluation.compute_rmse(residual), 0.0)
    object.__setattr__(candidate, "stated", frozenset(names))
    return candidate


def settle(pool, *candidates, input_squares=0.0, unsteady=False, refit=lambda candidate: candidate, **changes):
    """Return the noise model after candidates with unknown floor, or with a changed estimate."""
    propagated = np.broadcast_to(input_squares, (RUNS, len(pool.evaluation.force)))
    estimate = replace(pool.noise_model.estimate, **{
        "noise": BOUND, "high_frequency": BOUND, "cycle_to_cycle": None, "deviation": None, "scales": (),
        **changes,
    })  # fmt: skip
    model = NoiseModel(estimate, pool.noise_model.stretches, has_unsteady_cycles=unsteady)
    model.input_noise = float(np.sqrt(np.mean(propagated)))
    regression = ResidualRegression(pool.evaluation, model.floor)
    take_floor_from_residual(
        model,
        candidates,
        regression,
        pool.problems.block_length,
        lambda fit: find_fitted(candidates, fit),
        refit,
        lambda candidate: propagated,
    )
    return model


def find_fitted(candidates, fit):
    """Return the candidate of a fit; each has one of its own."""
    return next(c for c in candidates if c.fit is fit)


def draw_noise(pool, seed=1):
    return NOISE * np.random.default_rng(seed).standard_normal(len(pool.evaluation.force))


def find_structure(pool):
    """A part of the residual that depends on the stroke."""
    x = np.concatenate([p.excitation.displacement for p in pool.evaluation.pieces])
    return 4.0 * NOISE * np.sin(2.0 * x / x.std())


def test_a_residual_that_nothing_predicts_is_the_floor_with_an_interval(pool):
    model = settle(pool, make_candidate(pool, draw_noise(pool)))

    assert model.noise == pytest.approx(NOISE, rel=0.05)
    assert model.estimate.is_known
    low, high = model.estimate.get_interval(model.noise)
    assert BOUND < low < NOISE < high
    assert "few cycles repeat" in model.estimate.basis
    assert model.estimate.coloured_share == pytest.approx(1.0 - (BOUND / model.noise) ** 2)


def test_a_residual_that_depends_on_the_stroke_leaves_the_lower_bound(pool):
    model = settle(pool, make_candidate(pool, find_structure(pool) + draw_noise(pool)))

    assert (model.noise, model.estimate.is_known) == (BOUND, False)


def test_the_smallest_set_without_structure_gives_the_floor(pool):
    law = make_candidate(pool, find_structure(pool) + draw_noise(pool))
    one = make_candidate(pool, draw_noise(pool), "gas_spring")
    two = make_candidate(pool, 0.99 * draw_noise(pool, seed=2), "gas_spring", "end_stop")

    model = settle(pool, law, one, two)

    assert model.noise == pytest.approx(np.sqrt(np.mean(one.residual.values[one.residual.valid] ** 2)))


def test_a_set_with_a_larger_error_on_the_fitted_strokes_is_not_the_floor(pool):
    fitted = np.where(pool.evaluation.fitted_samples, 1.1, 1.0)
    law = make_candidate(pool, fitted * draw_noise(pool))
    one = make_candidate(pool, draw_noise(pool), "gas_spring")

    assert settle(pool, law, one).noise == pytest.approx(NOISE, rel=0.02)


def test_a_set_at_the_noise_of_high_frequencies_changes_nothing(pool):
    white = make_candidate(pool, 0.7 * draw_noise(pool))
    assert settle(pool, white).noise == BOUND


@pytest.mark.parametrize(
    ("noise", "deviation", "settled"),
    [
        pytest.param(NOISE / 1.25, 0.15 * NOISE, True, id="in a wide interval"),
        pytest.param(NOISE / 1.25, 0.08 * NOISE, False, id="above a wide interval"),
        pytest.param(NOISE / 1.06, 0.02 * NOISE, False, id="narrow interval"),
    ],
)
def test_a_floor_of_few_cycles_is_replaced_within_its_interval(pool, noise, deviation, settled):
    estimate = {"noise": noise, "cycle_to_cycle": noise, "deviation": deviation}
    model = settle(pool, make_candidate(pool, draw_noise(pool)), **estimate)
    assert model.noise == pytest.approx(NOISE if settled else noise, rel=0.03)


@pytest.mark.parametrize(("size", "settled"), [(1.0, True), (1.2, False)])
def test_a_residual_as_the_noise_at_every_known_scale_is_the_floor_beyond_its_interval(pool, size, settled):
    """Cycles show fast noise only, and an interval that contains no slower noise."""
    noise = draw_noise(pool, seed=3)
    known = []
    for samples in (1, 2, 4, 8):
        variance, count = measure_scale_variance(noise, np.ones(len(noise), bool), samples)
        known.append(ScaleVariance.from_signal(samples, variance, count))
    estimate = {"noise": NOISE / 1.3, "cycle_to_cycle": NOISE / 1.3, "deviation": 0.01 * NOISE}
    model = settle(pool, make_candidate(pool, size * draw_noise(pool)), scales=tuple(known), **estimate)
    assert model.noise == pytest.approx(NOISE if settled else NOISE / 1.3, rel=0.03)


def test_an_error_that_is_strong_in_few_blocks_is_not_the_floor(pool):
    bursts = np.where(np.arange(len(pool.evaluation.force)) % 997 < 40, 8.0, 0.5)
    assert not settle(pool, make_candidate(pool, bursts * draw_noise(pool))).estimate.is_known


def test_an_error_that_a_fit_to_all_samples_removes_is_none_of_the_law(pool):
    """The fitted strokes can leave a coordinate open that a held-out one needs."""
    bursts = np.where(np.arange(len(pool.evaluation.force)) % 997 < 40, 8.0, 1.0)
    held_out = np.where(pool.evaluation.held_out_samples, bursts, 1.0)
    candidate = make_candidate(pool, held_out * draw_noise(pool))
    assert not settle(pool, candidate).estimate.is_known
    refitted = make_candidate(pool, draw_noise(pool))
    assert settle(pool, candidate, refit=lambda one: refitted).estimate.is_known


@pytest.mark.parametrize(("chance", "adequate"), [(0.0, False), (0.2, True)])
def test_slow_noise_may_be_larger_on_the_held_out_samples(chance, adequate):
    """A candidate is not refused for an error that noise of its spectrum has by chance."""
    candidate = SimpleNamespace(train_rmse=1.0, held_out_rmse=1.2)
    noise = SimpleNamespace(noise=1.05, compute_chance=lambda samples: chance)
    assert _is_adequate(candidate, 1.0, 1.0, noise, 1000) is adequate
    assert not _is_adequate(SimpleNamespace(train_rmse=1.1, held_out_rmse=1.0), 1.0, 1.0, noise, 1000)


def test_bursts_by_the_noise_of_the_displacement_leave_the_rest_as_the_floor(pool):
    place = np.arange(len(pool.evaluation.force))
    bursts = np.where(place % 997 < 40, 3.0, 0.0) * NOISE
    residual = draw_noise(pool) + bursts * np.random.default_rng(2).standard_normal(len(place))
    assert not settle(pool, make_candidate(pool, residual)).estimate.is_known
    runs = bursts * np.random.default_rng(3).standard_normal((RUNS, len(place)))
    assert settle(pool, make_candidate(pool, residual), input_squares=runs**2).estimate.is_known


def draw_bursts(pool, seed):
    """Bursts in every block, whose size differs from one to the next."""
    place = np.arange(len(pool.evaluation.force))
    sizes = np.random.default_rng(seed).standard_normal(len(place) // 197 + 1)
    return np.where(place % 197 < 20, 6.0 * NOISE, 0.0) * sizes[place // 197]


def test_bursts_of_the_displacement_differ_in_size_from_run_to_run(pool):
    candidate = make_candidate(pool, draw_noise(pool) + draw_bursts(pool, 4))
    squares = np.stack([draw_bursts(pool, 5 + k) ** 2 for k in range(RUNS)])
    assert not settle(pool, candidate, input_squares=squares.mean(axis=0)).estimate.is_known
    assert settle(pool, candidate, input_squares=squares).estimate.is_known


def test_a_line_of_one_size_is_not_the_floor(pool):
    time = np.arange(len(pool.evaluation.force)) / RATE
    line = 3.0 * NOISE * np.sin(2.0 * np.pi * 51.3 * time)
    assert not settle(pool, make_candidate(pool, line + 0.5 * draw_noise(pool))).estimate.is_known


@pytest.mark.parametrize("seed", range(8))
def test_blocks_of_slow_noise_scatter_as_those_of_simulated_noise(seed):
    """Each has few independent samples. One such residual in six was refused with the error of white noise."""
    noise, nothing = make_pink_noise(25_000, np.random.default_rng(seed)), np.zeros((8, 25_000))
    found = compare_scatter(make_residual(noise, 500.0), float(np.mean(noise**2)), nothing, 0.15)
    assert found < CHANCE_DEVIATIONS
    bursts = noise * (1.0 + 4.0 * (np.arange(len(noise)) // 500 % 16 == 0))
    found = compare_scatter(make_residual(bursts, 500.0), float(np.mean(bursts**2)), nothing, 0.15)
    assert found > CHANCE_DEVIATIONS


def test_recordings_of_different_rates_cannot_be_compared():
    noise = make_pink_noise(2_000, np.random.default_rng(1))
    residual = replace(make_residual(noise, 500.0), rates=((1_000, 500.0), (1_000, 250.0)))
    assert compare_scatter(residual, 1.0, np.zeros((8, 2_000)), 0.15) is None


def judge_cycles(pool, values, **changes):
    """Return whether cycles are discarded with this residual of the law, and the noise model."""
    estimate = {"noise": 1.2 * NOISE, "high_frequency": NOISE, "deviation": 0.05 * NOISE, **changes}
    model = NoiseModel(replace(pool.noise_model.estimate, **estimate), pool.noise_model.stretches)
    nothing = np.zeros((RUNS, len(values)))
    law, length = make_candidate(pool, values), pool.problems.block_length
    return discard_unsteady_cycles(model, law, pool.evaluation, lambda candidate: nothing, length), model


def draw_rare_bursts(pool):
    """Noise, and bursts that do not repeat with the cycles."""
    return draw_noise(pool) * np.where(np.arange(len(pool.evaluation.force)) % 997 < 60, 3.0, 1.0)


def test_cycles_are_no_floor_where_what_does_not_repeat_comes_in_bursts(pool):
    discarded, model = judge_cycles(pool, draw_rare_bursts(pool))

    assert discarded
    assert (model.noise, model.estimate.is_known) == (NOISE, False)
    assert "changes in size otherwise than noise" in model.estimate.basis


def draw_line(pool):
    """A line in proportion to the drive, at no multiple of the stroke's frequency."""
    time = np.arange(len(pool.evaluation.force)) / RATE
    return 4.0 * NOISE * pool.evaluation.drive * np.sin(2.0 * np.pi * 13.7 * time)


def test_cycles_are_no_floor_where_a_line_that_does_not_repeat_grows_with_the_drive(pool):
    """Its blocks hardly scatter more than those of noise with such a line."""
    discarded, model = judge_cycles(pool, draw_noise(pool) + draw_line(pool))
    assert discarded
    assert "grows or falls with the drive" in model.estimate.basis


@pytest.mark.parametrize("unsteady", [True, False])
def test_a_line_that_grows_with_the_drive_is_not_the_floor_after_cycles_were_discarded(pool, unsteady):
    """Else it may be a form error of an effect, which also grows with the drive."""
    candidate = make_candidate(pool, draw_noise(pool) + draw_line(pool))
    assert settle(pool, candidate, unsteady=unsteady).estimate.is_known is not unsteady


def test_noise_of_the_displacement_may_grow_with_the_drive(pool):
    """A force that the drive makes steep shows more of it."""
    drive, random = pool.evaluation.drive, np.random.default_rng(6)
    runs = 8.0 * NOISE * drive * random.standard_normal((RUNS, len(drive)))
    residual = make_candidate(
        pool, draw_noise(pool) + 8.0 * NOISE * drive * random.standard_normal(len(drive))
    ).residual
    nothing = np.zeros_like(runs)

    def compare(squares):
        return compare_with_drive(residual, drive, NOISE**2, squares, pool.problems.block_length)

    assert compare(nothing) > CHANCE_DEVIATIONS > compare(runs**2)
    assert compare_with_drive(residual, np.ones_like(drive), NOISE**2, nothing, pool.problems.block_length) is None


@pytest.mark.parametrize(
    ("size", "changes"),
    [
        pytest.param(1.2, {}, id="stationary noise"),
        pytest.param(1.2, {"deviation": None}, id="no cycles repeat"),
    ],
)
def test_cycles_remain_the_floor_of_stationary_noise(pool, size, changes):
    discarded, model = judge_cycles(pool, size * draw_noise(pool), **changes)
    assert (discarded, model.noise) == (False, 1.2 * NOISE)


def test_a_law_at_the_noise_of_high_frequencies_needs_no_comparison(pool):
    discarded, _ = judge_cycles(pool, draw_rare_bursts(pool), high_frequency=2.0 * NOISE)
    assert not discarded

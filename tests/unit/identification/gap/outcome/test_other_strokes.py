"""Growth of the remaining error on strokes outside the recorded ranges."""

from types import SimpleNamespace

import numpy as np
import pytest

from identification.fitting import EffectModel
from identification.gap.outcome.other_strokes import (
    _change_stroke,
    _draw_function,
    _draw_growths,
    _Strokes,
    estimate_error_growth,
)
from tests.support.fit_problems import LABORATORY, STROKES, piece_of, problem_of, sine

SINGLE = [sine(0.010, 1.5)]
VARIED = [*STROKES, sine(0.004, 4.0), sine(0.014, 0.6)]


def fit(strokes, *effects):
    problem = problem_of(LABORATORY, strokes).replace_effects(effects)
    unknowns = problem.make_start(LABORATORY)
    for model, columns in problem.iterate_effects():
        unknowns[columns] += np.where(model.log_mask, 0.0, 1.0)
    return SimpleNamespace(fit=SimpleNamespace(problem=problem, minimum=SimpleNamespace(unknowns=unknowns)))


def grow(strokes, name):
    return estimate_error_growth(fit(strokes, EffectModel.from_name(name)), fit(strokes))


@pytest.mark.parametrize("name", ["gas_spring", "field_saturation"])
def test_the_error_grows_more_from_one_stroke_than_from_many(name):
    single, varied = grow(SINGLE, name), grow(VARIED, name)
    assert single.shape == varied.shape
    assert np.median(single) > 1.2 * np.median(varied) > 0.0


def test_it_is_a_smaller_part_of_a_gap_that_grows_with_the_speed():
    """The force of a mass grows with the square of the speed."""
    slow_small, fast_small, slow_large, fast_large = np.median(grow(SINGLE, "moving_mass").reshape(-1, 4), axis=0)
    assert fast_small < 0.7 * slow_small
    assert fast_large < 0.7 * slow_large


def test_the_baseline_may_be_fitted_at_another_rate():
    named, law = fit(SINGLE, EffectModel.from_name("gas_spring")), fit(SINGLE)
    slower = SimpleNamespace(problem=law.fit.problem.decimate(4), minimum=law.fit.minimum)
    found = estimate_error_growth(named, SimpleNamespace(fit=slower))
    assert np.array_equal(found, estimate_error_growth(named, law))


def test_the_same_candidates_give_the_same_growth():
    assert np.array_equal(grow(SINGLE, "gas_spring"), grow(SINGLE, "gas_spring"))


def test_a_model_that_is_unstable_on_other_strokes_says_nothing_about_them():
    problem = problem_of(LABORATORY, SINGLE)
    random = np.random.default_rng(2)
    variables, J = random.uniform(-1.0, 1.0, (50, 5)), random.standard_normal((50, problem.layout.size))
    stable, unstable = _Strokes(variables, J, 2.0), _Strokes(variables, np.inf * J, np.inf)
    assert np.isfinite(_draw_growths(stable, [stable, unstable], problem)).all()
    assert len(_draw_growths(stable, [stable, unstable], problem)) == len(_draw_growths(stable, [stable], problem))
    assert _draw_growths(stable, [unstable], problem) == pytest.approx([1.0])


def test_a_change_of_speed_keeps_the_path():
    piece = piece_of(SINGLE[0])
    changed = _change_stroke(piece, amplitude=1.5, speed=2.0, centre=0.001).excitation
    recorded = piece.excitation
    assert changed.rate == 2.0 * recorded.rate
    assert changed.displacement - 0.001 == pytest.approx(1.5 * (recorded.displacement - 0.001))
    by_difference = np.gradient(changed.displacement, 1.0 / changed.rate)
    assert changed.velocity[1:-1] == pytest.approx(by_difference[1:-1], abs=1e-3 * np.abs(by_difference).max())
    by_difference = np.gradient(changed.velocity, 1.0 / changed.rate)
    assert changed.acceleration[1:-1] == pytest.approx(by_difference[1:-1], abs=1e-3 * np.abs(by_difference).max())


def test_random_functions_have_a_mean_square_of_one():
    random = np.random.default_rng(3)
    points = random.uniform(-1.0, 1.0, (50, 5))
    squares = [_draw_function(random)(points) ** 2 for _ in range(4000)]
    assert np.mean(squares) == pytest.approx(1.0, abs=0.05)

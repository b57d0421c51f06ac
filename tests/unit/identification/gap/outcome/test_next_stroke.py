"""The proposed stroke separates rival models by a difference that no refit removes."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bench.methods.compile import compile_method
from bench.methods.document import Method, MethodSegment
from identification.damper.effects import EFFECTS
from identification.gap.data.cycles import StrokeCondition
from identification.gap.outcome.next_stroke import (
    RivalModel,
    _compute_detectability,
    _compute_irreducible_norm,
    _find_limits,
    _PredictedForce,
    compute_information,
    find_best_segment,
)
from identification.gap.outcome.trial_segments import StrokeLimits, generate_trial_segments
from identification.simulate import ActiveEffect
from tests.support.candidate_pools import fit_baseline
from tests.support.effects import LABORATORY

LIMITS = StrokeLimits(amplitude=0.015, centre=0.0, velocity=0.2, frequency=3.0, drives=(0.0, 0.5))
NOISE = 2.0


def make_rival(name, *values):
    active = ActiveEffect(EFFECTS[name], values)
    return RivalModel((name,), LABORATORY, (active,), 0.5, 0.0, np.diag(np.full(13 + len(values), 1e-6)))


def propose(*rivals):
    return find_best_segment(rivals, LABORATORY, LIMITS, NOISE)


def test_one_set_needs_no_stroke():
    assert propose(make_rival("moving_mass", 2.0)) is None


def test_delay_and_mass_are_separated_inside_the_limits():
    proposed = propose(make_rival("moving_mass", 2.0), make_rival("force_delay", 1e-3))
    motion = MethodSegment.model_validate(proposed.segment).motion
    assert motion.amplitude_m <= LIMITS.amplitude * 1.001
    assert 2 * np.pi * motion.amplitude_m * motion.frequency_hz <= LIMITS.velocity * 1.01
    assert proposed.separated_sets == [["moving_mass"], ["force_delay"]]
    assert proposed.detectability > 10.0


def test_a_difference_that_a_refit_removes_does_not_count():
    uncertain = make_rival("moving_mass", 0.05)
    certain = replace(uncertain, information=np.diag(np.full(14, 1e12)))
    other = replace(make_rival("force_delay", 2e-4), information=certain.information)
    assert propose(certain, other).detectability >= propose(uncertain, other).detectability


def test_form_errors_hide_a_difference_as_noise_does():
    rivals = [make_rival("moving_mass", 2.0), make_rival("force_delay", 1e-3)]
    inexact = [replace(r, form_error=0.3) for r in rivals]
    assert propose(*inexact).detectability < 0.5 * propose(*rivals).detectability


def test_a_parameter_without_sensitivity_hides_no_refit_of_the_others():
    information = np.diag(np.full(14, 1e-6))
    information[LABORATORY._fields.index("eta")] *= 1e14
    mass = (ActiveEffect(EFFECTS["moving_mass"], (0.5,)),)
    damped = LABORATORY._replace(c0_a=1.01 * LABORATORY.c0_a)
    proposed = propose(
        RivalModel(("law",), LABORATORY, mass, 0.5, 0.0, information),
        RivalModel(("damped",), damped, mass, 0.5, 0.0, information),
    )
    assert proposed.difference > 0.1
    assert proposed.detectability < 0.05 * proposed.difference / NOISE * np.sqrt(6000)


def test_the_information_of_a_fit_gives_the_deviation_of_an_effect():
    pool = fit_baseline("moving_mass")
    fit = pool.candidates[pool.extend("moving_mass")].fit
    information = compute_information(fit)
    assert information.shape == (14, 14)
    size = np.sqrt(np.diag(information))
    covariance = np.linalg.pinv(information / np.outer(size, size), rcond=1e-12) / np.outer(size, size)
    assert np.sqrt(covariance[13, 13]) == pytest.approx(fit.deviations["moving_mass"]["mass"], rel=0.2)


def test_the_bench_compiles_every_trial_segment():
    for segment, excitation in generate_trial_segments(LIMITS):
        document = {
            "schema": "mrbench.method/1",
            "name": "next",
            "title": "Proposed",
            "description": "One segment.",
            "rate_hz": 1000.0,
            "drive_kind": "coil_v",
            "limits": {
                "stroke_m": 0.05,
                "velocity_mps": 1.0,
                "acceleration_mps2": 30.0,
                "force_n": 5000.0,
                "drive": 0.5,
            },
            "segments": [segment],
        }
        programme = compile_method(Method.model_validate(document))
        assert len(programme.displacement) >= len(excitation.displacement)


def make_rival_with(information):
    return RivalModel(("law",), LABORATORY, (), 0.5, 0.0, np.array(information, float))


@pytest.mark.parametrize(
    ("information", "remaining"),
    [
        # The difference (3, 4, 12) has a part of 3 along the only column, of which a refit removes 1 / (1 + I).
        ([[0.0]], np.sqrt(16.0 + 144.0)),
        ([[1.0]], np.sqrt(169.0 - 4.5)),
        ([[1e12]], 13.0),
    ],
)
def test_a_refit_removes_the_part_that_the_recording_leaves_free(information, remaining):
    J = np.array([[1.0], [0.0], [0.0]])
    norm = _compute_irreducible_norm(np.array([3.0, 4.0, 12.0]), J, make_rival_with(information))
    assert norm == pytest.approx(remaining)


def test_the_unknown_zero_of_the_channel_is_free_and_an_insensitive_parameter_harmless():
    J = np.array([[0.0, 1.0], [0.0, 1.0]])
    assert _compute_irreducible_norm(np.array([5.0, 3.0]), J, make_rival_with([[0.0]])) == pytest.approx(
        np.sqrt(2.0)
    )
    small = np.array([1e-3, 1e-3])
    assert _compute_irreducible_norm(small, J, make_rival_with([[0.0]])) == pytest.approx(0.0, abs=1e-9)


def make_prediction(force, slope, error):
    J = np.zeros((3, 1))
    J[slope] = 1.0
    return _PredictedForce(make_rival_with([[0.0]]), np.array(force, float), J, error)


def test_the_rival_that_imitates_the_other_better_and_the_larger_error_count():
    a, b = make_prediction([6, 8, 0], 0, 2.0), make_prediction([0, 0, 0], 1, 4.0)
    # Refits leave 8 N and 6 N: 6 N over an error of 4 N.
    assert _compute_detectability(a, b, 2.0) == pytest.approx(1.5)
    assert _compute_detectability(b, a, 2.0) == pytest.approx(1.5)


def make_piece(low, high, speed):
    velocity = np.full(2000, 0.1)
    velocity[:3] = speed
    return SimpleNamespace(excitation=SimpleNamespace(displacement=np.array([low, 0.0, high]), velocity=-velocity))


@pytest.mark.parametrize(("recorded", "frequency"), [(0.4, 0.5), (1.5, 1.5)])
def test_the_limits_are_those_of_the_recording(recorded, frequency):
    conditions = (StrokeCondition(0.0, 0.01, recorded), StrokeCondition(0.0, 0.01, 0.0))
    pool = SimpleNamespace(
        evaluation=SimpleNamespace(
            pieces=(make_piece(-0.02, 0.01, 9.0), make_piece(-0.01, 0.03, 0.2)),
            cycles=SimpleNamespace(conditions=conditions),
        ),
        problems=SimpleNamespace(full=SimpleNamespace(space=SimpleNamespace(lowest_drive=0.1, highest_drive=0.6))),
    )
    limits = _find_limits(pool)
    assert (limits.amplitude, limits.centre) == pytest.approx((0.025, 0.005))
    assert (limits.frequency, limits.drives) == (frequency, (0.1, 0.6))
    # Three of two thousand samples are faster than the quantile of 99.9 %.
    assert limits.velocity == pytest.approx(9.0)

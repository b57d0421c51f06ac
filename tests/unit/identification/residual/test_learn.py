"""Learning of a residual that is known, and of noise."""

from dataclasses import replace

import numpy as np
import pytest

from identification.documents import TwinResidual
from identification.residual import LearnedResidual, ResidualSamples, StateUnits, learn_residual
from identification.simulate import Excitation
from identification.threads import use_one_thread
from tests.support.strokes import sine

UNITS = StateUnits(500.0, 0.012, 0.0, 0.15, 0.0, 0.5)
RATE = 200.0
NOISE = 2.0


def make_stretch(number, amplitude, frequency, residual, drive=0.25):
    """Return a stroke of a viscous law with some residual of displacement, velocity and drive."""
    x, v = sine(amplitude, frequency, 2.0, RATE)
    excitation = Excitation(RATE, x, v, np.gradient(v) * RATE, np.full(len(x), drive))
    noise = NOISE * np.random.default_rng(number).standard_normal(len(x))
    made = residual(x, v, drive) + noise
    return ResidualSamples(excitation, 4000.0 * v, made, np.ones(len(x), bool), np.full(len(x), number))


def make_stretches(residual):
    strokes = ((0.012, 1.0), (0.01, 1.5), (0.006, 2.0), (0.008, 2.5), (0.01, 0.5))
    return [make_stretch(i, *s, residual, drive) for i, s in enumerate(strokes) for drive in (0.0, 0.5)]


def seal(x, v, drive):
    """Return a force [N] that peaks shortly above rest and is larger with the drive."""
    return (20.0 + 40.0 * drive) * np.tanh(v / 0.01) * np.exp(-np.abs(v) / 0.05)


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    """Matrices are small, and threads only wait for each other."""
    with use_one_thread():
        yield


@pytest.fixture(scope="module")
def learned():
    return learn_residual(make_stretches(seal), UNITS, 1)


def test_a_residual_is_predicted_on_a_stroke_that_was_not_read(learned):
    assert learned.conditions == 5
    assert learned.after_n < 0.6 * learned.before_n
    unseen = make_stretch(99, 0.009, 1.8, seal)
    predicted = LearnedResidual(learned).predict(unseen.excitation, unseen.law_force)
    error = unseen.residual - predicted.force
    assert np.std(error) < 0.35 * np.std(unseen.residual)
    inside = np.abs(error) < 1.96 * np.hypot(predicted.deviation, learned.rest_n)
    assert inside.mean() > 0.85


def test_outside_the_recorded_states_the_residual_is_zero_and_uncertain(learned):
    stroke = make_stretch(99, 0.012, 1.0, seal)
    fast = replace(stroke.excitation, velocity=1e6 * stroke.excitation.velocity)
    predicted = LearnedResidual(learned).predict(fast, 1e6 * stroke.law_force)
    moving = np.abs(stroke.excitation.velocity) > 0.01
    assert np.abs(predicted.force[moving]).max() < 0.01 * learned.prior_n
    assert predicted.deviation[moving] == pytest.approx(learned.prior_n, rel=0.01)


@pytest.mark.parametrize(
    "residual", [lambda x, v, drive: 0.0 * x, lambda x, v, drive: 50.0 * np.sin(1e3 * np.ptp(v) + 0.0 * x)]
)
def test_what_no_other_condition_predicts_is_not_learned(residual):
    assert learn_residual(make_stretches(residual), UNITS, 1) is None


def test_one_condition_gives_no_residual():
    assert learn_residual([make_stretch(0, 0.01, 1.0, seal)], UNITS, 1) is None


def test_samples_that_may_not_be_read_have_no_influence():
    stretches = make_stretches(seal)
    spoiled = [s._replace(residual=np.where(np.arange(len(s.used)) < 200, s.residual, 1e4)) for s in stretches]
    masked = [s._replace(used=np.arange(len(s.used)) < 200) for s in spoiled]
    clean = [s._replace(used=np.arange(len(s.used)) < 200) for s in stretches]
    assert learn_residual(masked, UNITS, 1) == learn_residual(clean, UNITS, 1)


def test_a_residual_read_from_its_document_predicts_the_same(learned):
    again = TwinResidual.model_validate_json(learned.model_dump_json())
    stroke = make_stretch(3, 0.007, 2.2, seal)
    a, b = (LearnedResidual(r).predict(stroke.excitation, stroke.law_force) for r in (learned, again))
    assert np.array_equal(a.force, b.force)
    assert np.array_equal(a.deviation, b.deviation)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"points": [[0.0]]}, "points"),
        ({"weights": [1.0]}, "weights"),
        ({"factor": [[1.0], [1.0]]}, "factor"),
    ],
)
def test_a_document_with_parts_of_different_size_is_refused(learned, change, reason):
    with pytest.raises(ValueError, match=reason):
        TwinResidual.model_validate({**learned.model_dump(), **change})

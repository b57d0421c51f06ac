"""Derivatives of functional forms by dual numbers."""

import numpy as np
import pytest

from identification.damper.definitions.expression import Expression
from identification.damper.effects import EFFECTS
from identification.simulate.dual import DualNumber, differentiate, evaluate_by_differences

RANDOM = np.random.default_rng(20)
ARGUMENTS = {
    "field": (RANDOM.uniform(-2.0, 2.0, 50),),
    "scaling": (RANDOM.uniform(-0.02, 0.02, 50), RANDOM.uniform(-0.3, 0.3, 50)),
    "parallel_force": (RANDOM.uniform(-0.02, 0.02, 50), RANDOM.uniform(-0.3, 0.3, 50)),
    "connection": (),
    "inertia": (RANDOM.uniform(-9.0, 9.0, 50),),
    "time_shift": (),
    "force_lag": (),
    "additive_force": (RANDOM.uniform(0.0, 1.0, 50), RANDOM.uniform(0.0, 2.0, 50)),
    "displacement_map": (RANDOM.uniform(-0.02, 0.02, 50),),
    "displacement_shift": (),
}
"""Arguments before the parameters, for each action of which a form has no memory."""
FORMS = [
    pytest.param(form, id=f"{effect.name}-{form.name}")
    for effect in EFFECTS.values()
    for form in effect.forms
    if form.action in ARGUMENTS
]


def make_values(form):
    """Return parameters well inside the bounds of a form: its last start, with sizes that are not zero."""
    moved = [v + 0.1 * min(q.scale, q.high - q.low) for v, q in zip(form.starts[-1], form.parameters, strict=True)]
    return [float(np.clip(v, q.low, q.high)) for v, q in zip(moved, form.parameters, strict=True)]


@pytest.mark.parametrize("form", FORMS)
def test_derivatives_of_every_form_agree_with_differences(form):
    arguments = [*ARGUMENTS[form.action], *make_values(form)]
    found, rows = differentiate(form.function, arguments)
    expected = np.array(np.broadcast_arrays(*np.atleast_1d(form.function(*arguments))))
    np.testing.assert_array_equal(np.squeeze(found), np.squeeze(expected))
    assert len(rows) == len(arguments)
    for k, row in enumerate(rows):
        step = 1e-6 * (float(np.max(np.abs(arguments[k]))) or 1.0)
        ahead, behind = (
            np.array(
                np.broadcast_arrays(
                    *np.atleast_1d(form.function(*arguments[:k], arguments[k] + s, *arguments[k + 1 :]))
                )
            )
            for s in (step, -step)
        )
        difference = np.squeeze((ahead - behind) / (2.0 * step))
        # A difference across a corner is the mean of both sides.
        wrong = np.abs(np.squeeze(row) - difference) > 1e-5 * max(float(np.abs(difference).max()), 1e-9)
        assert np.mean(wrong) <= 0.02, f"argument {k}"


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("a*tanh(velocity/s)", lambda v, a, s: (np.tanh(v / s), -a * v / s**2 / np.cosh(v / s) ** 2)),
        (
            "a*sign(velocity)*abs(velocity)**s",
            lambda v, a, s: (np.sign(v) * np.abs(v) ** s, a * np.sign(v) * np.abs(v) ** s * np.log(np.abs(v))),
        ),
        (
            "a*exp(-abs(velocity)/s)",
            lambda v, a, s: (np.exp(-np.abs(v) / s), a * np.exp(-np.abs(v) / s) * np.abs(v) / s**2),
        ),
        ("a*log(velocity**2+s)", lambda v, a, s: (np.log(v**2 + s), a / (v**2 + s))),
        ("a*sin(velocity*s)", lambda v, a, s: (np.sin(v * s), a * v * np.cos(v * s))),
    ],
)
def test_derivatives_of_an_expression_are_exact(expression, expected):
    parsed, v = Expression.parse(expression), np.array([-0.3, -0.1, 0.05, 0.2])

    def evaluate(a, s):
        return parsed.evaluate({"velocity": v, "a": a, "s": s})

    found, rows = differentiate(evaluate, (20.0, 0.7))
    np.testing.assert_array_equal(found, evaluate(20.0, 0.7))
    for row, wanted in zip(rows, expected(v, 20.0, 0.7), strict=True):
        np.testing.assert_allclose(row, wanted, rtol=1e-12)


def test_a_power_of_zero_has_finite_derivatives():
    _, (over_v, over_p) = differentiate(
        lambda v, p: np.sign(v) * np.abs(v) ** p, (np.array([-4.0, 0.0, 4.0]), 0.5)
    )
    np.testing.assert_allclose(over_v, [0.25, 0.0, 0.25])
    np.testing.assert_allclose(over_p, [-2.0 * np.log(4.0), 0.0, 2.0 * np.log(4.0)])


def test_an_operation_without_a_rule_is_an_error():
    with pytest.raises(TypeError):
        differentiate(np.arctan, (np.array([1.0, 2.0]),))
    with pytest.raises(TypeError):
        differentiate(np.cumsum, (np.array([1.0, 2.0]),))


def test_an_opaque_function_is_differentiated_by_differences():
    number = evaluate_by_differences(lambda t: np.array([t, t**3]), DualNumber(2.0, {4: 5.0}))
    np.testing.assert_array_equal(number.value, [2.0, 8.0])
    np.testing.assert_allclose(number.partials[4], [5.0, 60.0], rtol=1e-9)
    np.testing.assert_array_equal(evaluate_by_differences(lambda t: np.array([t]), 2.0), [2.0])

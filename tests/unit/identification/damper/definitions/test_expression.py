"""Expressions of effect files: their values, their limits, and the text that is refused."""

import pickle

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from identification.damper.definitions import Expression, Instruction
from identification.errors import EffectFileError

X = np.array([-2.0, -0.5, 0.0, 1e-3, 0.5, 3.0])
Y = np.array([0.5, -1.5, 2.0, -3.0, 0.25, 1.0])
KNOWN = {
    "x": np.array([-2.5, -1.0, 0.0, 0.3, 1.7]),
    "y": np.array([0.4, -3.0, 2.0, 0.0, -0.1]),
    "two": np.full(5, 2.0),
    "three": np.full(5, 3.0),
}
"""Values of the names in random expressions; exponents are arrays, so both evaluations call the same function."""
WRAPPED = (
    *("-{}", "+{}", "({})", "abs({})", "sign({})", "tanh({})", "sin({})"),
    *("exp(tanh({}))", "log(1 + abs({}))", "{} ** two", "{} ** three"),
)
"""Expressions around another one, whose values do not reach the limits."""
PYTHON = {name: getattr(np, name) for name in ("abs", "sign", "exp", "log", "tanh", "sin")}


def evaluate(text, **values):
    return Expression.parse(text).evaluate(values)


def extend(inner):
    """Return expressions one level deeper; mostly without brackets, so the order of operators decides."""
    pairs = st.tuples(inner, st.sampled_from("+-*"), inner).map(" ".join)
    divided = st.tuples(inner, inner).map(lambda two: f"{two[0]} / (2 + tanh({two[1]}))")
    wrapped = st.tuples(st.sampled_from(WRAPPED), inner).map(lambda two: two[0].format(two[1]))
    return st.one_of(pairs, divided, wrapped)


TEXTS = st.recursive(st.sampled_from(["x", "y", "0.5", "3", "1e-2", "-x"]), extend, max_leaves=12)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(TEXTS)
def test_the_value_is_that_of_python(text):
    assume(len(text) <= 1000)
    with np.errstate(all="ignore"):
        expected = eval(text, {"__builtins__": {}}, {**KNOWN, **PYTHON})
    np.testing.assert_array_equal(evaluate(text, **KNOWN), expected)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x + y", X + Y),
        ("x - y", X - Y),
        ("x * y", X * Y),
        ("x / y", X / Y),
        ("(1 + abs(x)) ** y", (1.0 + np.abs(X)) ** Y),
        ("-x", -X),
        ("+x", X),
        ("abs(x)", np.abs(X)),
        ("sign(x)", np.sign(X)),
        ("exp(x)", np.exp(X)),
        ("log(abs(x) + 1)", np.log1p(np.abs(X))),
        ("tanh(x)", np.tanh(X)),
        ("sin(x)", np.sin(X)),
        ("(x\n+ y)", X + Y),
        ("  x  ", X),
    ],
)
def test_each_operator_and_function_has_its_value(text, expected):
    np.testing.assert_allclose(evaluate(text, x=X, y=Y), expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1 + 2 * 3", 7.0),
        ("(1 + 2) * 3", 9.0),
        ("8 - 4 - 2", 2.0),
        ("8 / 4 / 2", 1.0),
        ("2 ** 3 ** 2", 512.0),
        ("-2 ** 2", -4.0),
        ("(-2) ** 2", 4.0),
        ("2 ** -1", 0.5),
        ("2 * -3 + 1", -5.0),
        ("--3", 3.0),
        ("2 * 3 ** 2", 18.0),
        ("1e-3 * 1_000", 1.0),
    ],
)
def test_operators_bind_as_in_python(text, expected):
    assert evaluate(text) == expected


def test_an_expression_is_steps_of_a_stack_machine():
    assert Expression.parse("a * tanh(x) - 2").instructions == (
        Instruction("name", "a"),
        Instruction("name", "x"),
        Instruction("tanh"),
        Instruction("*"),
        Instruction("number", 2.0),
        Instruction("-"),
    )


def test_the_names_are_those_of_variables_and_parameters():
    assert Expression.parse("a * tanh(x / a) + abs(2 * time)").names == {"a", "x", "time"}
    assert Expression.parse("exp(1)").names == set()


def test_a_name_without_a_value_is_an_error():
    with pytest.raises(KeyError, match="y"):
        evaluate("x + y", x=1.0)


def test_an_expression_can_be_hashed_and_sent_to_another_process():
    one, other = Expression.parse("a * x"), Expression.parse("a * x")
    assert {one: 1}[other] == 1
    assert pickle.loads(pickle.dumps(one)) == one
    assert one != Expression.parse("x * a")


def test_numbers_and_arrays_have_the_same_values():
    text = "a * tanh(x / 0.1) * abs(x) ** 0.5 - x ** 3 / (1 + x ** 2)"
    one_by_one = [float(evaluate(text, x=float(x), a=4.0)) for x in X]
    np.testing.assert_allclose(evaluate(text, x=X, a=4.0), one_by_one, rtol=1e-14)


def test_the_exponential_ends_at_its_largest_argument():
    found = evaluate("exp(x)", x=np.array([49.0, 50.0, 51.0, 1e9]))
    np.testing.assert_allclose(found, np.exp([49.0, 50.0, 50.0, 50.0]))


def test_a_divisor_is_never_zero():
    found = evaluate("3 / x", x=np.array([2e-12, -2e-12, 1e-13, 0.0, -1e-13]))
    np.testing.assert_allclose(found, [1.5e12, -1.5e12, 3e12, 3e12, 3e12])


def test_a_logarithm_has_a_smallest_argument():
    found = evaluate("log(x)", x=np.array([2e-12, 1e-13, 0.0, -5.0]))
    np.testing.assert_allclose(found, np.log([2e-12, 1e-12, 1e-12, 1e-12]))


def test_a_base_may_be_negative_if_the_exponent_is_whole():
    np.testing.assert_allclose(evaluate("x ** 3", x=X), X**3)
    np.testing.assert_allclose(evaluate("x ** 0", x=X), np.ones(6))
    np.testing.assert_allclose(evaluate("x ** 1", x=X), X)
    np.testing.assert_allclose(evaluate("x ** -1", x=X[X != 0.0]), 1.0 / X[X != 0.0])


def test_a_fractional_exponent_has_a_smallest_base():
    found = evaluate("x ** 0.5", x=np.array([4.0, 0.0, -4.0]))
    np.testing.assert_allclose(found, [2.0, 1e-6, 1e-6])


def test_a_negative_exponent_has_the_limit_of_a_division():
    x = np.array([0.0, 1e-13, -1e-13, -0.5, 2.0])
    np.testing.assert_allclose(evaluate("x ** -2", x=x), [1e24, 1e24, 1e24, 4.0, 0.25])
    np.testing.assert_allclose(evaluate("x ** -1", x=x), evaluate("1 / x", x=x))
    np.testing.assert_allclose(evaluate("x ** -0.5", x=x[[0, 4]]), [1e6, 0.5**0.5])


def test_exponents_that_are_whole_in_part_are_treated_sample_by_sample():
    found = evaluate("x ** n", x=np.array([-2.0, -2.0, 0.0]), n=np.array([2.0, 0.5, -1.0]))
    np.testing.assert_allclose(found, [4.0, 1e-6, 1e12])


def test_values_beyond_the_limits_cause_no_warning():
    x = np.array([-1e300, -1.0, 0.0, 1e300, np.inf, np.nan])
    found = evaluate("exp(x) / x + log(x) * x ** 0.5 - x ** 9 / sin(x)", x=x)
    assert found.shape == (6,)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("sqrt(x)", "sqrt(x)"),
        ("__import__('os')", "__import__('os')"),
        ("eval(x)", "eval(x)"),
        ("tanh(x)(x)", "tanh(x)(x)"),
        ("x.real", "x.real"),
        ("x.real(1)", "x.real(1)"),
        ("x[0]", "x[0]"),
        ("'text'", "'text'"),
        ("b'text'", "b'text'"),
        ("f'{x}'", "f'{x}'"),
        ("x < 1", "x < 1"),
        ("x == 1", "x == 1"),
        ("lambda: x", "lambda: x"),
        ("abs(x=1)", "abs(x=1)"),
        ("abs(x, out=x)", "abs(x, out=x)"),
        ("abs()", "abs()"),
        ("abs(x, 1)", "abs(x, 1)"),
        ("abs(*x)", "*x"),
        ("abs(**x)", "abs(**x)"),
        ("True", "True"),
        ("2 * False", "False"),
        ("None", "None"),
        ("...", "..."),
        ("1j", "1j"),
        ("x // 2", "x // 2"),
        ("x % 2", "x % 2"),
        ("x @ x", "x @ x"),
        ("x << 2", "x << 2"),
        ("~x", "~x"),
        ("not x", "not x"),
        ("x and 1", "x and 1"),
        ("x if x else 1", "x if x else 1"),
        ("(x, 1)", "(x, 1)"),
        ("[x]", "[x]"),
        ("{x}", "{x}"),
        ("[x for x in x]", "[x for x in x]"),
        ("(x := 1)", "(x := 1)"),
    ],
)
def test_anything_else_is_refused_and_named(text, named):
    with pytest.raises(EffectFileError) as refusal:
        Expression.parse(text)
    assert str(refusal.value) == (
        f"the expression contains {named!r}; admitted are numbers, names, + - * / ** and "
        "abs, sign, exp, log, tanh, sin of one argument"
    )


@pytest.mark.parametrize("inner", ["x[0]", "sqrt(x)", "x < 1"])
@pytest.mark.parametrize("outer", ["-{}", "1 + {}", "{} * 2", "2 ** {}", "tanh({})"])
def test_it_is_refused_inside_an_expression_too(outer, inner):
    with pytest.raises(EffectFileError, match="the expression contains"):
        Expression.parse(outer.format(f"({inner})"))


UNREADABLE = ("", "   ", "x +", "x y", "x = 1", "x; x", "import os", "x\x00", "\ud800", "(x", "1x")


@pytest.mark.parametrize("text", UNREADABLE)
def test_text_that_is_no_expression_cannot_be_read(text):
    with pytest.raises(EffectFileError, match="cannot be read"):
        Expression.parse(text)


@pytest.mark.parametrize("text", ["1" + "0" * 400, "1e400", "2 * -1e999"])
def test_a_number_that_is_too_large_is_refused(text):
    with pytest.raises(EffectFileError, match=r"cannot be read: .*too large"):
        Expression.parse(text)


def test_a_text_that_is_too_long_is_refused():
    assert Expression.parse("x" * 1000).names == {"x" * 1000}
    with pytest.raises(EffectFileError, match="has 1001 characters; at most 1000 are admitted"):
        Expression.parse("x" * 1001)


@pytest.mark.parametrize("text", ["-" * 999 + "x", "(" * 499 + "x" + ")" * 499])
def test_a_text_that_is_nested_too_deeply_is_refused(text):
    with pytest.raises(EffectFileError, match="cannot be read"):
        Expression.parse(text)


def test_a_refusal_of_a_long_text_is_short():
    with pytest.raises(EffectFileError) as refusal:
        Expression.parse("x + " * 240)
    assert len(str(refusal.value)) < 220
    with pytest.raises(EffectFileError) as refusal:
        Expression.parse("[" + "x, " * 300 + "x]")
    assert len(str(refusal.value)) < 220


def test_a_long_sum_is_admitted():
    assert evaluate("+".join(["x"] * 300), x=1.0) == 300.0

"""Basis of smooth curves: what it can follow, the size of its curves, and the factors of a curve function."""

import numpy as np
import pytest

from identification.gap.discovery.curve_basis import (
    MAX_GROWTH,
    CurveFunction,
    LinearGrowth,
    make_basis,
    make_periodic_basis,
)

LOW, HIGH = -0.02, 0.03
EVEN = np.linspace(LOW, HIGH, 3001)


def follow(values, target, warp="none"):
    """Return the largest error of the best curve, over the largest value of the target."""
    basis = make_basis(values, warp)
    table = np.array(basis.table)
    inside = np.array(basis.positions)
    coefficients = np.linalg.lstsq(table.T, target(inside), rcond=None)[0]
    return np.abs(basis.evaluate(inside, coefficients) - target(inside)).max() / np.abs(target(inside)).max()


@pytest.mark.parametrize(
    ("target", "limit"),
    [
        (np.ones_like, 1e-10),
        (lambda z: 3.0 * z, 1e-10),
        (lambda z: (z / HIGH) ** 3 - (z / HIGH) ** 2, 1e-10),
        (lambda z: np.sin(z / 0.01), 2e-3),
        (lambda z: np.exp(-z / 0.01), 2e-3),
    ],
)
def test_a_smooth_curve_is_reproduced(target, limit):
    assert follow(EVEN, target) < limit


def test_a_curve_has_no_more_freedom_than_its_coefficients():
    basis = make_basis(EVEN, "none")
    assert basis.size == 12
    assert np.linalg.matrix_rank(np.array(basis.table)) == basis.size
    assert follow(EVEN, lambda z: np.sign(np.sin(z / 1e-4))) > 0.5


@pytest.mark.parametrize("knots", [8, 12, 24, 48])
def test_coefficients_of_unit_size_give_curves_of_unit_size_for_any_number_of_knots(knots):
    table = np.array(make_basis(EVEN, "none", knots).table)
    assert len(table) == knots
    deviation = np.sqrt(np.sum(table**2, axis=0))  # of a curve with independent coefficients of deviation one
    assert deviation.min() == pytest.approx(2.6, rel=0.1)
    assert deviation.max() == pytest.approx(3.6, rel=0.1)


def test_a_rough_curve_needs_larger_coefficients_than_a_smooth_one():
    basis = make_basis(EVEN, "none")
    sizes = [
        np.linalg.norm(np.linalg.lstsq(np.array(basis.table).T, target, rcond=None)[0])
        for target in (np.ones(401), np.linspace(-1, 1, 401), np.sin(np.linspace(0, 20, 401)))
    ]
    assert max(sizes[:2]) < 1.0
    assert sizes[2] > 3.0 * max(sizes[:2])


def test_the_size_of_the_variable_does_not_matter():
    small, large = (np.array(make_basis(s * EVEN, "symmetric").table) for s in (1e-3, 1e3))
    np.testing.assert_allclose(small, large)


def test_a_periodic_curve_repeats_and_follows_three_harmonics():
    basis, time = make_periodic_basis(0.02), np.arange(40_000) / 1000.0
    angle = 2.0 * np.pi * time / 0.02
    target = 3.0 * np.sin(angle + 0.4) - np.cos(2.0 * angle) + 0.5 * np.sin(3.0 * angle)
    table = np.stack([basis.evaluate(time, row) for row in np.eye(basis.size)], axis=1)
    assert np.abs(table @ np.linalg.lstsq(table, target, rcond=None)[0] - target).max() < 2e-3
    fourth = np.sin(4.0 * angle)
    assert np.abs(table @ np.linalg.lstsq(table, fourth, rcond=None)[0]).max() < 1e-2


@pytest.mark.parametrize(
    ("warp", "target"),
    [
        ("symmetric", lambda z: np.tanh(z / (0.03 * HIGH))),
        ("logarithmic", lambda z: 1.0 - np.exp(-z / (0.03 * HIGH))),
    ],
)
def test_a_warp_resolves_small_values(warp, target):
    values = np.linspace(0.0 if warp == "logarithmic" else -HIGH, HIGH, 3001)
    assert follow(values, target, warp) < 0.02
    assert follow(values, target) > 10.0 * follow(values, target, warp)


@pytest.mark.parametrize("warp", ["none", "symmetric", "logarithmic"])
def test_positions_increase_from_one_end_of_the_values_to_the_other(warp):
    values = np.linspace(0.0 if warp == "logarithmic" else LOW, HIGH, 100_001)
    positions = np.array(make_basis(values, warp).positions)
    assert (np.diff(positions) > 0.0).all()
    # One value of a thousand lies beyond either end.
    assert positions[[0, -1]] == pytest.approx(np.quantile(values, (0.001, 0.999)), abs=1e-9)


def test_a_curve_is_constant_beyond_its_ends():
    basis = make_basis(EVEN, "none")
    coefficients = np.random.default_rng(1).standard_normal(basis.size)
    ends = np.array(basis.positions)[[0, -1]]
    np.testing.assert_array_equal(
        basis.evaluate(np.array([-9.0, 9.0]), coefficients), basis.evaluate(ends, coefficients)
    )


VARIABLES = {
    "displacement": np.array([-0.015, 0.0, 0.01, 0.02]),
    "velocity": np.array([-0.3, 0.0, 0.2, -1.0]),
    "drive": np.array([0.0, 0.5, 1.5, 2.0]),
}
NAMES = ("displacement", "velocity", "drive")
BASIS = make_basis(EVEN, "none")
COEFFICIENTS = np.random.default_rng(2).standard_normal(BASIS.size)
CURVE = BASIS.evaluate(VARIABLES["displacement"], COEFFICIENTS)


@pytest.mark.parametrize(
    ("options", "values", "factor"),
    [
        ({}, (), [1.0, 1.0, 1.0, 1.0]),
        ({"direction": "sign"}, (), [-1.0, 0.0, 1.0, -1.0]),
        ({"drive_factor": True}, (), [0.0, 0.5, 1.5, 2.0]),
        ({"grows_with_drive": True}, (3.0,), [1.0, 2.5, 5.5, 7.0]),
        ({"direction": "sign", "grows_with_drive": True}, (-0.5,), [-1.0, 0.0, 0.25, 0.0]),
    ],
)
def test_a_curve_function_has_the_factors_of_its_place(options, values, factor):
    function = CurveFunction(BASIS, NAMES, 40.0, **options)
    np.testing.assert_allclose(function(VARIABLES, *COEFFICIENTS, *values), 40.0 * CURVE * factor)


@pytest.mark.parametrize(("growth", "sign"), [(0.8, 1.0), (0.8, -1.0), (-0.4, 1.0), (0.0, -1.0)])
def test_a_product_is_separated_into_its_curve_and_growth(growth, sign):
    highest = 2.0
    function = CurveFunction(BASIS, NAMES, 40.0, direction="sign", grows_with_drive=True)
    linear = LinearGrowth(function, highest)
    values = np.concatenate([sign * COEFFICIENTS, sign * growth * highest * COEFFICIENTS])
    level, found = linear.separate(values)
    np.testing.assert_allclose(level, sign * COEFFICIENTS)
    assert found == pytest.approx(growth)
    np.testing.assert_allclose(function(VARIABLES, *level, found), linear(VARIABLES, *values))


def test_of_two_curves_that_are_no_product_the_nearest_is_found():
    linear = LinearGrowth(CurveFunction(BASIS, NAMES, 1.0, grows_with_drive=True), 2.0)
    other = np.roll(COEFFICIENTS, 1)
    other -= other @ COEFFICIENTS / (COEFFICIENTS @ COEFFICIENTS) * COEFFICIENTS
    level, growth = linear.separate(np.concatenate([COEFFICIENTS, 0.5 * COEFFICIENTS + 0.1 * other]))
    np.testing.assert_allclose(level, COEFFICIENTS, atol=0.1)
    assert growth == pytest.approx(0.25, abs=0.01)


@pytest.mark.parametrize("level", [0.0, 1e-6, -1e-6])
def test_a_curve_that_is_proportional_to_the_drive_has_the_largest_growth_and_not_a_negative_one(level):
    linear = LinearGrowth(CurveFunction(BASIS, NAMES, 1.0, grows_with_drive=True), 2.0)
    coefficients, growth = linear.separate(np.concatenate([level * COEFFICIENTS, COEFFICIENTS]))
    assert growth == pytest.approx(MAX_GROWTH / 2.0)
    # The curve at the highest drive is kept.
    np.testing.assert_allclose(coefficients * growth * 2.0, COEFFICIENTS, rtol=1e-3)

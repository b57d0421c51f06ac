"""Ranges of effects follow the dimension of their unit."""

import pytest

from identification.damper.damper_size import (
    LARGEST_SIZE,
    LIBRARY_SIZE,
    RECORDING_TIME,
    SLOW_TIME,
    SMALLEST_SIZE,
    DamperSize,
    compute_scale_factor,
    scale_quantity,
    widen_bounds,
)
from identification.damper.effects import EFFECTS
from identification.damper.parameters import Quantity

FORCE, LENGTH, VELOCITY, DRIVE, OBSERVATION, RECORDING = 100.0, 4.0, 2.0, 5.0, 3.0, 7.0
FACTORS = FORCE, LENGTH, VELOCITY, DRIVE, OBSERVATION, RECORDING
LARGER = DamperSize(*(v * f for v, f in zip(LIBRARY_SIZE, FACTORS, strict=True)))
QUANTITIES = [
    pytest.param(q, id=f"{effect.name}-{form.name}-{q.symbol}")
    for effect in EFFECTS.values()
    for form in effect.forms
    for q in form.parameters
]


@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        ("1", 1.0),
        ("s", 1.0),  # electronics do not grow with the damper
        (SLOW_TIME, OBSERVATION),
        (RECORDING_TIME, RECORDING),
        ("Hz", 1.0),
        ("N", FORCE),
        ("m", LENGTH),
        ("m/s", VELOCITY),
        ("N/m", FORCE / LENGTH),
        ("m/N", LENGTH / FORCE),
        ("1/m^2", LENGTH**-2),
        ("N s/m", FORCE / VELOCITY),
        ("N s^2/m^2", FORCE / VELOCITY**2),
        ("kg", FORCE / (VELOCITY**2 / LENGTH)),
        ("1/J", 1.0 / (FORCE * LENGTH)),
        (f"s/(N m {SLOW_TIME})", 1.0 / (FORCE * VELOCITY * OBSERVATION)),  # energy of the observed time
        ("N/{drive}", FORCE / DRIVE),
        ("1/{drive}", 1.0 / DRIVE),
        ("N s/(m {drive})", FORCE / VELOCITY / DRIVE),
    ],
)
def test_a_quantity_grows_with_the_dimension_of_its_unit(unit, factor):
    assert compute_scale_factor(unit, LARGER) == pytest.approx(factor)


def test_an_unknown_unit_is_refused():
    with pytest.raises(KeyError, match="lbf"):
        compute_scale_factor("lbf/m", LARGER)


def test_bounds_and_scale_grow_together():
    scaled = scale_quantity(Quantity("gap", "m", 1e-4, 0.5, 8e-3, "stroke"), LARGER)
    assert (scaled.low, scaled.high, scaled.scale) == pytest.approx((4e-4, 2.0, 3.2e-2))
    assert (scaled.symbol, scaled.unit, scaled.meaning) == ("gap", "m", "stroke")


@pytest.mark.parametrize(("slowness", "high"), [(0.2, 0.05), (1.0, 0.05), (9.0, 0.45)])
def test_only_the_upper_bound_of_a_delay_grows_with_slower_motion(slowness, high):
    size = LIBRARY_SIZE._replace(velocity=LIBRARY_SIZE.velocity / slowness)
    scaled = scale_quantity(Quantity("delay", "s", 1e-4, 0.05, 2e-3, "delay"), size)
    assert (scaled.low, scaled.high, scaled.scale) == pytest.approx((1e-4, high, 2e-3))


def test_a_value_at_a_fixed_reference_follows_its_own_unit():
    quantity = Quantity("force", "N", 0.0, 5000.0, 10.0, "force at 0.1 m/s", "N s^2/m^2")
    assert scale_quantity(quantity, LARGER).scale == pytest.approx(10.0 * FORCE / VELOCITY**2)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_the_library_keeps_its_values_at_its_own_size(quantity):
    assert scale_quantity(quantity, LIBRARY_SIZE) == quantity


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize("size", [SMALLEST_SIZE, LARGEST_SIZE, LIBRARY_SIZE, LARGER])
def test_widened_bounds_admit_every_size(quantity, size):
    widened, scaled = widen_bounds(quantity), scale_quantity(quantity, size)
    assert widened.low <= scaled.low * (1.0 + 1e-12 * (1 if scaled.low > 0 else -1))
    assert widened.high >= scaled.high * (1.0 - 1e-12)

import math

import pytest

from bench.report.values import (
    format_drive,
    format_force,
    format_percent,
    format_quantity,
    format_ratio,
    format_rounded,
    format_significant,
    format_unit,
)


@pytest.mark.parametrize(
    ("value", "interval", "unit", "shown"),
    [
        (44.862, (44.766, 44.959), "N", "44.862 ± 0.097 N"),
        (2.924e-5, (2.904e-5, 2.944e-5), "m", "29.24 ± 0.20 µm"),
        (0.0193, (0.0190, 0.0196), "m", "19.30 ± 0.30 mm"),
        (2008611.3, (1851050.1, 2179584.1), "1/m^n", "(2.01 ± 0.17) × 10⁶ 1/mⁿ"),
        (18047.1, (17997.4, 18097.0), "N s/m", "18047 ± 50 N·s/m"),
        (-4341.9, (-6399.6, -2284.1), "N/m", "−4300 ± 2100 N/m"),
        (3.0, (1.0, 9.0), "N", "3.00 (1.0 … 9.0) N"),
        (301.0, None, "1", "301 1"),
        (0.0, None, "s", "0 s"),
        (80.0, (80.0, 80.0), "1/s", "80.0000 1/s"),
        (4.2e-6, (-1e-5, 1.84e-5), "s", "4 ± 14 µs"),
    ],
)
def test_a_quantity_is_rounded_to_what_its_interval_supports(value, interval, unit, shown):
    assert str(format_quantity(value, interval, unit)) == shown


@pytest.mark.parametrize(
    ("value", "shown"),
    [(2.5331, "2.53"), (64.07, "64.1"), (1234.5, "1230"), (0, "0"), (-0.01234, "−0.0123"), (math.nan, "–")],
)
def test_a_number_keeps_three_significant_digits_without_powers_of_ten(value, shown):
    assert format_significant(value) == shown


def test_forces_shares_and_units_are_written_out():
    assert format_force(2.5331) == "2.53 N"
    assert format_percent(0.00743) == "0.74 %"
    assert format_unit("N s/(m V)") == "N·s/(m·V)"
    assert format_unit("N/(m/s)^2") == "N/(m/s)²"
    assert format_rounded(-0.2341, 0.036) == "−0.23"


@pytest.mark.parametrize(("drive", "shown"), [(-9e-6, "0"), (0.100009, "0.1"), (0.03125, "0.031")])
def test_a_drive_is_rounded_to_its_span_and_never_a_negative_zero(drive, shown):
    assert format_drive(drive, 0.5) == shown


@pytest.mark.parametrize(
    ("value", "interval", "unit", "shown"),
    [
        (1.0, None, "m", "1 m"),
        (0.999, None, "m", "999 mm"),
        (1e-3, None, "m", "1 mm"),
        (0.999e-3, None, "s", "999 µs"),
        (2e-9, None, "m", "0.002 µm"),
        (-0.002, None, "s", "−2 ms"),
        (0.0, (-0.003, 0.002), "s", "0 (−3.0 … 2.0) ms"),
        (99999.0, None, "N", "1e+05 N"),
        (100000.0, None, "N", "1 × 10⁵ N"),
        (0.01, None, "N", "0.01 N"),
        (0.00999, None, "N", "9.99 × 10⁻³ N"),
        (10.0, (9.0, 10.8), "N", "10.0 ± 1.0 N"),
        (10.0, (9.0, 10.7), "N", "10.0 (9.0 … 11) N"),
        (10.0, (-math.inf, 11.0), "N", "10.0000 N"),
    ],
)
def test_multiple_and_interval_change_at_their_limits(value, interval, unit, shown):
    found = str(format_quantity(value, interval, unit))
    assert found == shown


@pytest.mark.parametrize(("ratio", "shown"), [(9.994, "9.99 times"), (10.0, "10.0 times"), (10.44, "10.4 times")])
def test_a_ratio_has_two_decimals_below_ten(ratio, shown):
    assert format_ratio(ratio) == shown


@pytest.mark.parametrize(
    ("drive", "span", "shown"), [(0.12344, 0.0, "0.1234"), (0.126, 5.0, "0.13"), (0.126, 4.9, "0.126")]
)
def test_a_drive_is_rounded_to_a_power_of_ten_below_a_five_hundredth_of_the_span(drive, span, shown):
    assert format_drive(drive, span) == shown

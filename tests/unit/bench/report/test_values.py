import math

import pytest

from bench.report.values import (
    format_drive,
    format_force,
    format_percent,
    format_quantity,
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
    assert format_rounded(-0.2341, 0.036) == "−0.23"


@pytest.mark.parametrize(("drive", "shown"), [(-9e-6, "0"), (0.100009, "0.1"), (0.03125, "0.031")])
def test_a_drive_is_rounded_to_its_span_and_never_a_negative_zero(drive, shown):
    assert format_drive(drive, 0.5) == shown

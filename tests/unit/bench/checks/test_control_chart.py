"""Control chart of individual values: limits by hand, rules, rate of false alarms, detection of a shift."""

import numpy as np
import pytest

from bench.checks import (
    BASELINE_POINTS,
    ChartLimits,
    CheckSeries,
    compute_chart,
    compute_ewma,
    compute_limits,
    find_rules,
    make_chart,
)
from tests.support.checks import IN_CONTROL, make_records

SERIES = CheckSeries(check="zero", channel="force", specimen="none")
# The baseline has centre 0 and standard deviation 2 / 1.128 = 1.7730.


def compute(values, uncertainty=0.1):
    return compute_chart(np.array(values), np.full(len(values), uncertainty))


def known_limits():
    """Return the limits for values with mean 0 and standard deviation 1."""
    ewma = 2.962 * (0.2 / 1.8) ** 0.5
    return ChartLimits(
        centre=0, sigma=1, sigma_from="moving_range", lower=-3, upper=3, ewma_lower=-ewma, ewma_upper=ewma
    )


def find_first(rules, wanted):
    """Return the number of the first check that breaks one of some rules; that of all checks if none does."""
    return next((number for number, one in enumerate(rules, start=1) if set(one) & wanted), len(rules))


def test_limits_agree_with_hand_calculation():
    # Moving ranges 2, 1, 4, 3: mean 2.5; 2.5 / 1.128 = 2.21631.
    limits = compute_limits(np.array([10.0, 12.0, 11.0, 15.0, 12.0]), np.full(5, 0.1))
    assert (limits.centre, limits.sigma_from) == (12.0, "moving_range")
    assert limits.sigma == pytest.approx(2.21631, abs=1e-5)
    # 2.66 is the constant of ISO 7870-2 for individual values, 3 / 1.128.
    assert limits.upper == pytest.approx(12 + 2.6596 * 2.5, abs=1e-3)
    assert limits.lower == pytest.approx(12 - 2.6596 * 2.5, abs=1e-3)
    # The factor is 2.962, the weight 0.2.
    assert limits.ewma_upper - 12 == pytest.approx(2.18824, abs=1e-4)


def test_equal_values_have_the_limits_of_their_own_uncertainty():
    limits = compute_limits(np.full(20, 5.0), np.full(20, 0.2))
    assert (limits.sigma_from, limits.sigma) == ("uncertainty", pytest.approx(0.2))
    assert compute([5.0] * 30, 0.0).state == "no_limits"


@pytest.mark.parametrize("count", [0, 1, 7, BASELINE_POINTS - 1])
def test_before_the_baseline_is_complete_there_are_no_limits(count):
    chart = make_chart(SERIES, make_records(IN_CONTROL[:count]), None)
    assert (chart.state, chart.limits, chart.count, chart.needed) == ("not_enough", None, count, 20)
    expected = f"not enough checks, {count} of 20" if count else "no zero check yet"
    assert expected in chart.text


def test_the_weighted_mean_agrees_with_hand_calculation():
    assert compute_ewma(np.array([1.0, 2.0, 0.0]), 0.0) == pytest.approx([0.2, 0.56, 0.448])


def test_a_value_beyond_the_limits_is_out_of_control_with_value_and_limit():
    chart = make_chart(SERIES, make_records([*IN_CONTROL, 0.0, 5.4]), None)
    assert (chart.state, chart.points[-1].rules) == ("out_of_control", ("beyond_limits",))
    assert chart.text == (
        "force: zero check of 2026-01-26 08:00 UTC is out of control: 5.4 N is above the limit 5.319 N"
    )


def test_the_eighth_value_on_one_side_is_out_of_control_and_the_seventh_is_not():
    values = [*IN_CONTROL, -0.5, *[0.3] * 8]
    states = [compute(values[:count]).state for count in range(20, len(values) + 1)]
    assert states == ["in_control"] * 9 + ["out_of_control"]
    chart = make_chart(SERIES, make_records(values), None)
    assert chart.points[-1].rules == ("run_of_eight",)
    assert "8 checks in a row are above the centre 0 N" in chart.text


def test_a_value_at_the_centre_ends_a_run():
    values = [*IN_CONTROL, *[0.3] * 7, 0.0, 0.3]
    assert compute(values).state == "in_control"


def test_a_change_of_the_mean_is_found_by_the_weighted_mean_where_no_other_rule_applies():
    # On both sides of the centre and within the limits of 5.319, but with mean 2.35; the limit is 1.7506.
    values = [*IN_CONTROL, *[4.9, -0.2] * 6]
    rules = compute(values).rules
    first = next(index for index, one in enumerate(rules) if one)
    assert rules[first] == ("drift",)
    # Weighted means 0.98, 0.744, 1.5752, 1.22016, 1.956128
    assert first == BASELINE_POINTS + 4
    text = make_chart(SERIES, make_records(values[: first + 1]), None).text
    assert text.endswith("out of control: the weighted mean 1.956 N is above the limit 1.751 N")


def test_a_baseline_with_a_value_beyond_its_own_limits_says_so():
    chart = make_chart(SERIES, make_records([*IN_CONTROL[:10], 12.0, *IN_CONTROL[11:], 0.0]), None)
    assert chart.state == "in_control"
    assert "1 of the baseline beyond them" in chart.text


def test_run_lengths_in_control_are_those_of_the_literature():
    generator, limits = np.random.default_rng(5), known_limits()
    series = generator.normal(size=(300, 2500))
    rules = [find_rules(one, compute_ewma(one, limits.centre), limits) for one in series]
    # Champ and Woodall (1987), Technometrics 29: 152.7 with both rules. The mean of 300 is known to 6 %.
    both = [find_first(one, {"beyond_limits", "run_of_eight"}) for one in rules]
    assert np.mean(both) == pytest.approx(152.7, rel=0.15)
    # Lucas and Saccucci (1990), Technometrics 32: 500 for weight 0.2 and factor 2.962.
    assert np.mean([find_first(one, {"drift"}) for one in rules]) == pytest.approx(500, rel=0.15)


def test_false_alarms_with_limits_from_the_baseline_are_as_documented():
    generator = np.random.default_rng(6)
    alarms = []
    for values in generator.normal(size=(400, BASELINE_POINTS + 30)):
        alarms += [bool(one) for one in compute(values, 0.0).rules[BASELINE_POINTS:]]
    # docs/how-to/check-the-channels.md states the rate.
    assert 0.025 < np.mean(alarms) < 0.055


def test_a_planted_zero_shift_of_four_standard_deviations_is_found_within_three_checks():
    generator, found = np.random.default_rng(7), []
    for values in generator.normal(size=(200, BASELINE_POINTS + 3)):
        values[BASELINE_POINTS:] += 4
        found.append(any(compute(values, 0.0).rules[BASELINE_POINTS:]))
    assert np.mean(found) > 0.97

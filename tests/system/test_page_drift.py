"""Drift of a quantity as the page computes it, against scipy and against the trend of the identification."""

from copy import deepcopy

import numpy as np
import pytest
from scipy import stats

from bench.campaign_report.drift import find_outliers, fit_drift
from identification.gap.trend import find_change_point
from tests.support.fake_specimens import DAYS, PRELOAD, STIFFNESS
from tests.support.page_in_browser import node_test, run_module

Z95 = stats.norm.ppf(0.975)
pytestmark = node_test


def ask(*questions):
    return run_module("fit_drift.mjs", "specimens/drift.js", questions)


def series(places, values, deviation, start=None):
    width = Z95 * deviation
    points = [
        {"x": x, "value": value, "ci95": [value - width, value + width]}
        for x, value in zip(places, values, strict=True)
    ]
    return {"points": points, "start": start}


def test_students_distribution_is_exact():
    cases = [(0.3, 1), (12.7062, 1), (4.3, 2), (2.5, 3), (1.1, 8), (636.6, 1), (1.96, 1000)]
    found = ask(*({"t": t, "freedom": freedom} for t, freedom in cases))
    assert found == pytest.approx([1 - 2 * stats.t.sf(t, freedom) for t, freedom in cases], abs=1e-9)


@pytest.mark.parametrize(("deviation", "quantile"), [(0.6, Z95), (0.2, stats.t.ppf(0.975, 6))])
def test_a_drift_with_a_change_equals_that_of_the_trend(deviation, quantile):
    deviations = np.full(len(PRELOAD), deviation)
    point = find_change_point(np.array(PRELOAD), deviations)
    (found,) = ask(series(range(1, 9), PRELOAD, deviation, start=point.start + 1))
    line = found["line"]
    assert point.start == 3
    assert line["slope"] == pytest.approx(point.slope, rel=1e-6)
    half = (line["ci95"][1] - line["ci95"][0]) / 2
    assert half == pytest.approx(quantile * abs(point.slope) / point.deviations, rel=2e-3)


def test_the_interval_of_a_drift_per_day_is_that_of_weighted_least_squares():
    values = [900.0, 901.5, 899.0, 902.0, 900.5, 903.0, 901.0, 902.5]
    (found,) = ask(series(DAYS, values, 5.0))
    design = np.column_stack([np.ones(len(DAYS)), DAYS])
    covariance = np.linalg.inv(design.T @ design) * 5.0**2
    _, slope = np.linalg.lstsq(design, np.array(values), rcond=None)[0]
    assert found["line"]["slope"] == pytest.approx(slope, rel=1e-6)
    half = (found["line"]["ci95"][1] - found["line"]["ci95"][0]) / 2
    assert half == pytest.approx(
        Z95 * np.sqrt(covariance[1, 1]), rel=2e-3
    )  # nearly normal: the scatter is explained
    assert found["outliers"] == []


def test_intervals_contain_the_true_drift_as_often_as_they_claim():
    draws = np.random.default_rng(5)
    # Runs differ more than the interval of each states, which is what a specimen does.
    many = [series(range(6), 3.0 + 0.5 * np.arange(6) + draws.normal(0, 4.0, 6), 1.0) for _ in range(600)]
    inside = [one["line"]["ci95"][0] <= 0.5 <= one["line"]["ci95"][1] for one in ask(*many)]
    assert 0.92 <= np.mean(inside) <= 0.98


def test_an_outlier_is_found_and_rarely_one_that_is_none():
    draws = np.random.default_rng(7)
    quiet = [series(range(8), 3.0 + 0.1 * np.arange(8) + draws.normal(0, 2.0, 8), 1.0) for _ in range(600)]
    false_alarms = np.mean([bool(one["outliers"]) for one in ask(*quiet)])
    assert false_alarms <= 0.05
    (found,) = ask(series(range(1, 9), STIFFNESS, 3.0))
    assert found["outliers"] == [2]


def test_the_campaign_report_has_the_drift_and_the_outliers_of_the_page():
    draws = np.random.default_rng(9)
    cases = [(DAYS, list(900 + draws.normal(0, spread, 8) + 40 * (k == 3) * np.eye(8)[5]), 5.0)
             for k, spread in enumerate((1.0, 4.0, 12.0, 6.0))]  # fmt: skip
    answers = ask(*(series(*case) for case in cases))
    for (places, values, deviation), one in zip(cases, answers, strict=True):
        halves = [Z95 * deviation] * len(values)
        line = fit_drift(places, values, halves)
        assert line.slope == pytest.approx(one["line"]["slope"], rel=1e-6)
        assert line.interval == pytest.approx(one["line"]["ci95"], rel=5e-3)
        assert find_outliers(places, values, halves) == one["outliers"]
    assert answers[3]["outliers"] == [5]


def test_runs_without_an_interval_do_not_count():
    full = series(range(1, 9), STIFFNESS, 3.0)
    without = deepcopy(full)
    without["points"][2]["ci95"] = None
    (found,) = ask(without)
    assert found["line"]["points"] == 7
    assert abs(found["line"]["slope"]) < 1
    assert found["outliers"] == []


@pytest.mark.parametrize("places", [(1, 2), (1, 1, 1, 1)])
def test_without_three_runs_at_different_times_there_is_no_drift(places):
    (found,) = ask(series(places, [float(k) for k in range(len(places))], 1.0))
    assert found == {"line": None, "outliers": []}


def test_a_change_at_the_last_run_has_no_interval_by_itself():
    (found,) = ask(series(range(1, 5), (1.0, 1.0, 1.0, 9.0), 0.5, start=4))
    assert found["line"] is None

"""Parts of the table of a trial."""

from types import SimpleNamespace

import pytest

from sim_rig.trial.scoring.table import _compute_median_ratio, _format_proportion, _list_misses
from sim_rig.trial.scoring.trial_report import Proportion


@pytest.mark.parametrize(
    ("fraction", "ci95", "text"),
    [
        (0.5, (0.2, 0.8), "3/6 = 50 % (20 to 80)"),
        (None, (0.2, 0.8), "-"),
        (0.5, None, "-"),
        (None, None, "-"),
    ],
)
def test_a_proportion_without_fraction_or_interval_is_a_dash(fraction, ci95, text):
    assert _format_proportion(Proportion(count=3, total=6, fraction=fraction, ci95=ci95)) == text


def test_a_miss_is_another_set_than_the_true_one():
    confusion = {"gas_spring": {"gas_spring": 4, "end_stop": 2}, "unknown: beats": {"beats": 3, "none": 1}}
    trial = SimpleNamespace(scores=SimpleNamespace(confusion=confusion))
    assert _list_misses(trial) == [("gas_spring", "end_stop", "2"), ("unknown: beats", "none", "1")]


def test_the_median_ratio_is_that_of_the_measured_cases_of_a_magnitude():
    cases = [
        SimpleNamespace(magnitude=m, error_ratio_before=r)
        for m, r in (("small", 1.1), ("small", 1.4), ("small", None), ("large", 9.0), ("small", 1.2))
    ]
    trial = SimpleNamespace(cases=cases)
    assert _compute_median_ratio(trial, "small") == 1.2
    assert _compute_median_ratio(trial, "medium") is None

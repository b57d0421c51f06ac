"""Repeatability and reproducibility against published examples and values computed by hand."""

from math import sqrt

import numpy as np
import pytest

from bench.campaign_report.scatter import analyse_scatter

LOOMS = [[98, 97, 99, 96], [91, 90, 93, 92], [96, 95, 97, 95], [95, 96, 99, 98]]
"""Strength of fabric from four looms: Montgomery, Design and Analysis of Experiments, random effects model."""
COAL = [
    [0.71, 0.71, 0.70, 0.71], [0.69, 0.67, 0.68], [0.66, 0.65, 0.69], [0.67, 0.65, 0.66],
    [0.70, 0.69, 0.66, 0.71, 0.69], [0.73, 0.74, 0.73], [0.71, 0.71, 0.69], [0.70, 0.65, 0.68],
]  # fmt: skip
"""Sulfur content of coal [%] at level 1 in eight laboratories: ISO 5725-2:1994, annex B.1."""


def test_a_balanced_published_example():
    found = analyse_scatter(LOOMS)
    assert found.repeatability**2 == pytest.approx(1.90, abs=0.005)
    assert found.between**2 == pytest.approx(6.96, abs=0.005)
    assert found.reproducibility**2 == pytest.approx(8.86, abs=0.01)
    assert (found.mountings, found.runs, found.missing, found.is_clipped) == (4, 16, "", False)


def test_the_unbalanced_example_of_the_standard():
    found = analyse_scatter(COAL)
    assert found.mean == pytest.approx(0.690, abs=0.0005)
    assert found.repeatability == pytest.approx(0.015, abs=0.0005)
    assert found.reproducibility == pytest.approx(0.026, abs=0.0005)
    assert found.repeatability_limit == pytest.approx(2.8 * found.repeatability)
    assert found.reproducibility_limit == pytest.approx(2.8 * found.reproducibility)


def test_an_unbalanced_case_by_hand():
    # Means 11 and 15; within 2 + 0 over 1 degree of freedom; n = 3 - 5/3 = 4/3; s_d² = 2·(4/3)² + (8/3)² = 32/3.
    found = analyse_scatter([[10.0, 12.0], [15.0]])
    assert found.repeatability == pytest.approx(sqrt(2.0))
    assert found.between == pytest.approx(sqrt((32 / 3 - 2) / (4 / 3)))
    assert found.reproducibility == pytest.approx(sqrt(2.0 + 6.5))


def test_a_negative_estimate_between_mountings_is_zero_and_reported():
    found = analyse_scatter([[10.0, 14.0], [11.0, 13.0]])
    assert (found.between, found.is_clipped) == (0.0, True)
    assert found.reproducibility == found.repeatability == pytest.approx(sqrt(5.0))


@pytest.mark.parametrize(
    ("groups", "has_repetition", "parts"),
    [
        ([[1.0]], False, ("1 more run in the same mounting", "1 run after a remount")),
        ([[1.0], [2.0]], False, ("1 more run in the same mounting",)),
        ([[1.0, 2.0]], True, ("1 run after a remount",)),
    ],
)
def test_too_few_runs_give_the_missing_ones_instead_of_a_number(groups, has_repetition, parts):
    found = analyse_scatter(groups)
    assert (found.repeatability is not None) is has_repetition
    assert found.between is None
    assert found.reproducibility is None
    assert found.reproducibility_limit is None
    assert all(part in found.missing for part in parts)
    assert found.missing.count("1 ") == len(parts)


def test_equal_values_scatter_by_zero():
    found = analyse_scatter([[3.0, 3.0], [3.0, 3.0]])
    assert (found.repeatability, found.between, found.is_clipped) == (0.0, 0.0, False)
    assert found.repeatability_ci95 == (0.0, 0.0)


def test_the_interval_of_the_repeatability_contains_it_as_often_as_it_claims():
    draws = np.random.default_rng(3).normal(0.0, 2.0, (2000, 3, 2)) + 5.0
    inside = [low <= 2.0 <= high for low, high in (analyse_scatter(one).repeatability_ci95 for one in draws)]
    assert np.mean(inside) == pytest.approx(0.95, abs=0.015)


def test_the_variances_are_unbiased():
    random = np.random.default_rng(11)
    found = [
        analyse_scatter(
            [list(random.normal(mean, 1.0, count)) for count, mean in zip((2, 3, 5, 2), means, strict=True)]
        )
        for means in random.normal(0.0, 6.0, (3000, 4))
    ]
    assert np.mean([one.repeatability**2 for one in found]) == pytest.approx(1.0, rel=0.03)
    assert np.mean([one.between**2 for one in found]) == pytest.approx(36.0, rel=0.06)

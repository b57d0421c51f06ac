"""Agreement of two estimates, as numbers and as text."""

import numpy as np
import pytest

from identification.damper.coordinates import Coordinates, to_coordinates
from identification.damper.parameter_sets import find_parameter_set
from identification.uncertainty.agreement import Agreement, compare_estimates

LABORATORY = to_coordinates(find_parameter_set("laboratory").parameters)
KNOWN = set(Coordinates._fields)
SPREAD = 0.01 * np.abs(np.array(LABORATORY))


def moved(**deviations) -> Coordinates:
    """The laboratory damper with some coordinates so many deviations off."""
    return LABORATORY._replace(
        **{
            name: getattr(LABORATORY, name) + by * SPREAD[Coordinates._fields.index(name)]
            for name, by in deviations.items()
        }
    )


def test_two_estimates_as_far_apart_as_chance_puts_them_agree():
    found = compare_estimates(moved(D_y=1.9, k0=-1.0), SPREAD, LABORATORY, SPREAD, KNOWN)
    assert found.is_consistent
    assert found.worst_coordinate == "D_y"
    assert found.deviations["D_y"] == pytest.approx(1.9)
    assert found.describe() == "agree: pinn and refine differ most in D_y by 1.9 deviations"


def test_a_coordinate_beyond_its_interval_is_named_among_all_that_are():
    found = compare_estimates(moved(D_y=3.1, k1=-30.0, n=2.1), SPREAD, LABORATORY, SPREAD, KNOWN)
    assert not found.is_consistent
    assert found.describe().startswith("disagree in D_y, k1, most in k1 by 30 deviations:")


def test_the_wider_of_two_intervals_counts_and_an_unknown_one_does_not():
    wide, unknown = 4.0 * SPREAD, np.full(13, np.nan)
    assert compare_estimates(moved(n=4.0), SPREAD, LABORATORY, wide, KNOWN).deviations["n"] == pytest.approx(1.0)
    assert compare_estimates(moved(n=4.0), unknown, LABORATORY, SPREAD, KNOWN).deviations["n"] == pytest.approx(
        4.0
    )
    assert compare_estimates(moved(n=4.0), unknown, LABORATORY, unknown, KNOWN).deviations == {}


def test_unobservable_coordinates_are_not_compared():
    found = compare_estimates(moved(c1_b=50.0, n=0.5), SPREAD, LABORATORY, SPREAD, {"n", "rho"})
    assert set(found.deviations) == {"n", "rho"}
    assert found.is_consistent


def test_without_a_common_coordinate_nothing_is_compared():
    assert Agreement({}).describe() == "nothing to compare: no coordinate is known to both stages"

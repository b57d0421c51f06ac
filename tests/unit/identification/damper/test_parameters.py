"""Tables, gauge, regular coordinates and the sets that ship."""

import warnings

import pytest

from identification.damper.coordinates import COORDINATES, Coordinates, to_coordinates, to_parameters
from identification.damper.parameter_sets import PARAMETER_SETS, check_drive_range, find_parameter_set
from identification.damper.parameters import GAUGE, PARAMETERS, Parameters

SOUND = [name for name, found in PARAMETER_SETS.items() if not found.warning]


@pytest.mark.parametrize(
    ("table", "fields"), [(PARAMETERS, Parameters._fields), (COORDINATES, Coordinates._fields)]
)
def test_table_and_fields_agree_one_to_one(table, fields):
    assert tuple(q.symbol for q in table) == fields
    assert all(q.low < q.high and q.scale > 0 and q.unit and q.meaning for q in table)


@pytest.mark.parametrize("name", SOUND)
def test_coordinates_go_there_and_back(name):
    p = PARAMETER_SETS[name].parameters
    assert to_parameters(to_coordinates(p), gauge=p.A) == pytest.approx(p, rel=1e-12)


def test_the_gauge_leaves_the_coordinates_alone():
    p, s = PARAMETER_SETS["spencer_1997"].parameters, 2.7
    other = p._replace(
        alpha_a=p.alpha_a * s, alpha_b=p.alpha_b * s, A=p.A / s,
        beta=p.beta * s ** (p.n - 1), gamma=p.gamma * s ** (p.n - 1),
    )  # fmt: skip
    assert to_coordinates(other) == pytest.approx(to_coordinates(p), rel=1e-12)


@pytest.mark.parametrize("name", SOUND)
def test_shipped_sets_are_dampers_inside_the_search_bounds(name):
    found = PARAMETER_SETS[name]
    assert check_drive_range(found.parameters, 0.0, found.drive_max) == []
    for quantity, value in zip(COORDINATES, to_coordinates(found.parameters), strict=True):
        assert quantity.low <= value <= quantity.high, quantity.symbol


def test_the_default_damper_has_the_stated_coordinates():
    c = to_coordinates(find_parameter_set("laboratory").parameters)
    assert c == pytest.approx((45, 900, 30e-6, 0.55, 2, 80, 700, 2200, 18e3, 26e3, 2200, 800, 16), rel=1e-9)
    assert find_parameter_set("laboratory").parameters.A == GAUGE


def test_the_papers_table_loads_with_a_warning_that_says_why_it_is_no_damper():
    with pytest.warns(UserWarning, match=r"-1627 N s/m at 0\.5 V"):
        p = find_parameter_set("paper_table_1").parameters
    assert p.c0_a + p.c0_b * 0.5 == pytest.approx(-1626.5, abs=1)
    faults = check_drive_range(p, 0.0, 0.5)
    assert len(faults) == 1
    assert "c0 is" in faults[0]
    assert "N s/m" in faults[0]


def test_sound_sets_load_without_a_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert find_parameter_set("spencer_1997").drive_unit == "V"


def test_an_unknown_set_names_those_that_exist():
    with pytest.raises(KeyError, match="laboratory"):
        find_parameter_set("labratory")


def test_no_spring_means_no_rest_position():
    c = to_coordinates(find_parameter_set("laboratory").parameters)._replace(k1=0.0)
    with pytest.raises(ZeroDivisionError):
        to_parameters(c)

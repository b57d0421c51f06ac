"""Defined effects: what a file becomes, and the values of its function."""

import json
import pickle

import numpy as np
import pytest

from identification.damper import scale_quantity, widen_bounds
from identification.damper.damper_size import LARGEST_SIZE
from identification.damper.definitions import ACTIONS, STAGE_OF, VARIABLES_AT, make_effect, parse_effect_file

V = np.array([-0.3, -0.05, 0.0, 0.02, 0.5])
DRIVE = np.array([0.0, 0.5, 1.0, 2.0, 0.25])


def make(content):
    return make_effect(parse_effect_file(json.dumps(content), "mine.json"))


def act(content):
    return make(content).find_form().function


def test_an_effect_has_what_its_file_says(content):
    effect = make(content)
    assert (effect.name, effect.stage, effect.variable) == ("rising_friction", "damper", "velocity")
    assert effect.meaning == "friction that grows with the drive"
    (form,) = effect.forms
    assert (form.name, form.action, form.place) == ("defined", "force_function", "parallel_force")
    assert form.starts == ((8.0, 0.0, 0.004),)
    assert form.memory is None
    assert [(q.symbol, q.unit, q.low, q.high) for q in form.parameters] == [
        ("base", "N", 0.0, 80.0),
        ("rise", "N/{drive}", -20.0, 40.0),
        ("width", "m/s", 0.0005, 0.05),
    ]


@pytest.mark.parametrize("place", VARIABLES_AT)
def test_an_effect_acts_at_its_place(place):
    variable = VARIABLES_AT[place][0]
    content = {"name": "mine", "stage": STAGE_OF[place], "place": place, "variables": [variable]}
    effect = make(content | {"expression": f"2 * {variable}"})
    assert effect.stage == STAGE_OF[place]
    assert effect.forms[0].action == ACTIONS[place]
    assert effect.forms[0].place == place


def test_a_function_of_the_force_in_the_mounting_is_an_elongation():
    content = {"name": "mine", "stage": "mounting", "place": "mounting", "variables": ["force"]}
    (form,) = make(content | {"expression": "1e-6*force"}).forms
    assert (form.action, form.place) == ("elongation_function", "mounting")


@pytest.mark.parametrize(
    ("value", "lo", "hi", "scale"),
    [
        (8.0, 0.0, 80.0, 8.0),
        (-8.0, -80.0, 0.0, 8.0),
        (0.0, -20.0, 40.0, 40.0),
        (0.0, -2e-5, 1e-5, 2e-5),
        (0.0, 0.0, 0.0, 1.0),
    ],
)
def test_the_scale_of_a_parameter_is_its_value_or_its_range(content, value, lo, hi, scale):
    content["parameters"]["base"] |= {"value": value, "lo": lo, "hi": hi}
    assert make(content).forms[0].parameters[0].scale == scale


def test_bounds_are_those_of_the_file_for_a_damper_of_any_size(content):
    content["parameters"]["base"]["unit"] = "lbf"
    for quantity in make(content).forms[0].parameters:
        assert scale_quantity(quantity, LARGEST_SIZE) == quantity
        assert widen_bounds(quantity) == quantity


def test_the_unit_names_the_drive(content):
    rise = make(content).forms[0].parameters[1]
    assert (rise.format_unit("V"), rise.format_unit("A")) == ("N/V", "N/A")


def test_the_function_takes_variables_by_name_and_parameters_in_their_order(content):
    found = act(content)({"velocity": V, "drive": DRIVE, "unknown": None}, 10.0, 4.0, 0.02)
    np.testing.assert_allclose(found, (10.0 + 4.0 * DRIVE) * np.tanh(V / 0.02), rtol=1e-14)


def test_the_function_takes_numbers_as_it_takes_arrays(content):
    function = act(content)
    many = function({"velocity": V, "drive": DRIVE}, 10.0, 4.0, 0.02)
    pairs = zip(V.tolist(), DRIVE.tolist(), strict=True)
    one = [function({"velocity": v, "drive": u}, 10.0, 4.0, 0.02) for v, u in pairs]
    np.testing.assert_allclose(many, one, rtol=1e-14)
    assert np.ndim(one[0]) == 0


def test_only_declared_variables_are_computed(content):
    class Variables(dict):
        def __missing__(self, name):
            raise AssertionError(f"{name} was asked for")

    assert act(content)(Variables(velocity=V, drive=DRIVE), 1.0, 0.0, 0.1).shape == V.shape


def test_a_number_of_values_other_than_that_of_the_parameters_is_an_error(content):
    with pytest.raises(ValueError, match="zip"):
        act(content)({"velocity": V, "drive": DRIVE}, 10.0, 4.0)


def test_a_variable_without_a_value_is_an_error(content):
    with pytest.raises(KeyError, match="drive"):
        act(content)({"velocity": V}, 10.0, 4.0, 0.02)


def test_an_expression_without_a_variable_has_the_shape_of_the_main_one():
    content = {"name": "offset", "stage": "force_channel", "place": "force_channel", "variables": ["time"]}
    content |= {"expression": "size", "parameters": {"size": {"value": 2.0, "unit": "N", "lo": 0.0, "hi": 9.0}}}
    assert act(content)({"time": V}, 3.0).tolist() == [3.0] * 5


def test_a_curve_is_straight_between_its_points_and_constant_beyond_its_ends(curve_content):
    velocity = np.array([-9.0, -0.1, -0.05, 0.0, 0.1, 0.2, 1e9])
    found = act(curve_content)({"velocity": velocity})
    np.testing.assert_allclose(found, [-5.0, -5.0, -2.0, 1.0, 5.0, 9.0, 9.0])


def test_an_expression_can_change_its_curve(curve_content, content):
    curve_content |= {"variables": ["drive", "velocity"], "expression": "base * curve + drive"}
    curve_content["parameters"] = {"base": content["parameters"]["base"]}
    found = act(curve_content)({"velocity": np.array([0.1, 0.3]), "drive": np.array([1.0, 2.0])}, 3.0)
    np.testing.assert_allclose(found, [16.0, 29.0])


def test_equal_files_have_equal_functions_that_can_be_hashed(content, curve_content):
    for some in (content, curve_content):
        assert {act(some): "found"}[act(some)] == "found"
    assert act(content) != act(content | {"expression": "(rise * drive + base) * tanh(velocity / width)"})
    other = curve_content | {"curve": curve_content["curve"] | {"value": [-5.0, 1.0, 8.0]}}
    assert act(curve_content) != act(other)


def test_a_function_can_be_sent_to_another_process(content, curve_content):
    for some, values in ((content, (10.0, 4.0, 0.02)), (curve_content, ())):
        effect = make(some)
        sent = pickle.loads(pickle.dumps(effect))
        assert sent == effect
        variables = {"velocity": V, "drive": DRIVE}
        function, sent_function = effect.forms[0].function, sent.forms[0].function
        np.testing.assert_array_equal(sent_function(variables, *values), function(variables, *values))

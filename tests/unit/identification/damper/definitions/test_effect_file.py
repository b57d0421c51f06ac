"""Effect files: valid ones in both directions, and each refusal with its message."""

import json
from typing import get_args

import pytest
from pydantic import ValidationError

from identification.damper.definitions import ACTIONS, STAGE_OF, VARIABLES_AT, EffectFile, parse_effect_file
from identification.damper.effects import EFFECTS, Place, Stage, Variable
from identification.damper.effects.effect import PLACES
from identification.errors import EffectFileError

PLACES_AND_VARIABLES = [(place, v) for place in VARIABLES_AT for v in get_args(Variable)]


def parse(content):
    return parse_effect_file(json.dumps(content), "mine.json")


def refuse(content):
    """Return the message with which a content is refused."""
    text = content if isinstance(content, str | bytes) else json.dumps(content)
    with pytest.raises(EffectFileError) as refusal:
        parse_effect_file(text, "mine.json")
    return str(refusal.value)


def test_a_file_has_what_it_was_written_with(content):
    file = parse(content)
    assert file.model_dump(by_alias=True) == content
    assert list(file.parameters) == ["base", "rise", "width"]
    assert file.parameters["width"].hi == 0.05


def test_a_file_survives_writing_and_reading(content, curve_content):
    for some in (content, curve_content):
        file = parse(some)
        assert parse_effect_file(file.model_dump_json(by_alias=True), "again.json") == file


def test_most_keys_may_be_left_out():
    file = parse(
        {"name": "offset", "stage": "force_channel", "place": "force_channel"}
        | {"variables": ["time"], "expression": "3 * tanh(time / 10)"}
    )
    assert (file.schema_, file.meaning, file.source) == ("mrbench.effect/1", "", "")
    assert (file.parameters, file.curve) == ({}, None)


def test_a_file_cannot_be_changed(content):
    with pytest.raises(ValidationError, match="frozen"):
        parse(content).name = "other"


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({}, "friction that grows with the drive"),
        ({"meaning": ""}, "(base + rise * drive) * tanh(velocity / width) acts at parallel force"),
    ],
)
def test_a_file_is_described_by_its_meaning_or_its_expression(content, changes, text):
    assert parse(content | changes).describe() == text


def test_a_curve_alone_is_described_by_its_place(curve_content):
    assert parse(curve_content).describe() == "a curve acts at parallel force"


def test_every_place_has_a_stage_an_action_and_variables():
    places = set(get_args(Place))
    assert set(VARIABLES_AT) == set(STAGE_OF) == set(ACTIONS) == places
    assert set(STAGE_OF.values()) == set(get_args(Stage))
    assert {place: PLACES[action] for place, action in ACTIONS.items()} == {place: place for place in places}


@pytest.mark.parametrize(
    ("place", "known"),
    [
        ("drive", {"drive", "drive_history", "time"}),
        ("field", {"drive", "drive_history", "time"}),
        ("force_channel", {"force", "drive", "time"}),
        ("displacement_channel", {"displacement", "velocity", "time"}),
    ],
)
def test_a_place_outside_the_damper_has_few_variables(place, known):
    assert set(VARIABLES_AT[place]) == known


def test_at_the_damper_there_is_neither_a_recorded_force_nor_a_history_of_the_drive():
    every = set(get_args(Variable))
    for place in ("damper_gain", "parallel_force"):
        assert every - set(VARIABLES_AT[place]) == {"force", "drive_history", "temperature"}
    assert every - set(VARIABLES_AT["mounting"]) == {"drive_history", "temperature"}


def test_in_the_mounting_the_force_acts_alone():
    content = {"name": "mine", "stage": "mounting", "place": "mounting", "expression": "force*velocity"}
    assert refuse(content | {"variables": ["force", "velocity"]}) == (
        "mine.json: in the mounting, force acts without other variables: the value is an elongation"
    )


@pytest.mark.parametrize(("place", "variable"), PLACES_AND_VARIABLES)
def test_a_file_admits_the_variables_of_its_place_and_no_others(place, variable):
    content = {"name": "mine", "stage": STAGE_OF[place], "place": place, "variables": [variable]}
    content["expression"] = f"tanh({variable})"
    if variable in VARIABLES_AT[place]:
        assert parse(content).variables == [variable]
    else:
        known = ", ".join(VARIABLES_AT[place])
        assert refuse(content) == f"mine.json: at {place} there are {known}, not {variable}"


@pytest.mark.parametrize("place", get_args(Place))
def test_a_place_belongs_to_one_stage(place):
    variable = VARIABLES_AT[place][0]
    content = {"name": "mine", "place": place, "variables": [variable], "expression": variable}
    for stage in get_args(Stage):
        if stage == STAGE_OF[place]:
            assert parse(content | {"stage": stage}).stage == stage
        else:
            message = f"mine.json: place {place} belongs to stage {STAGE_OF[place]}, not {stage}"
            assert refuse(content | {"stage": stage}) == message


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_an_effect_of_the_library_keeps_its_name(content, name):
    assert refuse(content | {"name": name}) == f"mine.json: the library has an effect {name}; choose another name"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"variables": ["velocity"]}, "the expression uses drive, which is not declared"),
        ({"expression": "base * rise * width * foo * bar"}, "the expression uses bar, foo, which is not declared"),
        ({"expression": "curve * base * rise * width"}, "the expression uses curve, which is not declared"),
        ({"expression": ""}, "the expression uses curve, which is not declared"),
        ({"expression": "base * velocity"}, "the expression does not use rise, width"),
        ({"expression": None}, "there is neither an expression nor a curve"),
        (
            {"variables": ["velocity", "velocity"]},
            "a variable is listed twice among velocity, velocity",
        ),
        (
            {"expression": "base.real"},
            "the expression contains 'base.real'; admitted are numbers, names, + - * / ** and "
            "abs, sign, exp, log, tanh, sin of one argument",
        ),
    ],
)
def test_an_expression_that_does_not_fit_is_refused(content, changes, message):
    assert refuse(content | changes) == f"mine.json: {message}"


@pytest.mark.parametrize("name", ["curve", "tanh", "exp", "time", "velocity", "temperature"])
def test_a_parameter_cannot_have_the_name_of_something_else(content, name):
    content["parameters"][name] = content["parameters"]["base"]
    assert refuse(content) == f"mine.json: {name} cannot be the name of a parameter"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"value": 90.0}, "parameters.base: value is 90, outside lo 0 to hi 80"),
        ({"value": -1.0}, "parameters.base: value is -1, outside lo 0 to hi 80"),
        ({"lo": 100.0}, "parameters.base: value is 8, outside lo 100 to hi 80"),
        ({"hi": float("inf")}, "parameters.base.hi: Input should be a finite number"),
        ({"value": float("nan")}, "parameters.base.value: Input should be a finite number"),
        ({"value": "much"}, "parameters.base.value: Input should be a valid number"),
        ({"unit": ""}, "parameters.base.unit: String should match pattern"),
        ({"unit": "N/{volt}"}, "parameters.base.unit: String should match pattern"),
        ({"unit": "N/{drive.real}"}, "parameters.base.unit: String should match pattern"),
        ({"unit": "N" * 41}, "parameters.base.unit: String should have at most 40 characters"),
        ({"scale": 1.0}, "parameters.base.scale: Extra inputs are not permitted"),
    ],
)
def test_a_parameter_that_is_not_valid_is_refused(content, change, message):
    content["parameters"]["base"] |= change
    assert refuse(content).startswith(f"mine.json: {message}")


def test_a_parameter_may_be_at_its_bounds(content):
    content["parameters"]["base"] |= {"value": 0.0}
    content["parameters"]["rise"] |= {"value": 40.0}
    assert parse(content).parameters["rise"].value == 40.0


@pytest.mark.parametrize("key", ["value", "unit", "lo", "hi"])
def test_a_parameter_needs_all_its_keys(content, key):
    del content["parameters"]["base"][key]
    assert refuse(content) == f"mine.json: parameters.base.{key}: Field required"


@pytest.mark.parametrize("name", ["Width", "width_2", "", "w-x", "w" * 41])
def test_names_are_of_small_letters(content, name):
    parameter = content["parameters"]["base"]
    assert refuse(content | {"name": name}).startswith("mine.json: name: String should")
    assert "String should" in refuse(content | {"parameters": {name: parameter}})


@pytest.mark.parametrize("key", ["name", "stage", "place", "variables"])
def test_a_file_needs_its_main_keys(content, key):
    del content[key]
    assert refuse(content) == f"mine.json: {key}: Field required"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"schema": "mrbench.effect/2"}, "schema: Input should be 'mrbench.effect/1'"),
        ({"stage": "oil"}, "stage: Input should be 'coil', "),
        ({"place": "oil"}, "place: Input should be 'drive', "),
        ({"variables": ["power"]}, "variables.0: Input should be 'displacement', "),
        ({"variables": []}, "variables: List should have at least 1 item"),
        (
            {"variables": ["velocity"] * 4},
            "variables: List should have at most 3 items",
        ),
        ({"meaning": "m" * 201}, "meaning: String should have at most 200 characters"),
        ({"source": "s" * 501}, "source: String should have at most 500 characters"),
        ({"form": "tanh"}, "form: Extra inputs are not permitted"),
    ],
)
def test_a_key_that_is_not_valid_is_refused(content, changes, message):
    assert refuse(content | changes).startswith(f"mine.json: {message}")


@pytest.mark.parametrize("text", ["", "{", "not json", b"\xff\xfe", '{"name": "a", }'])
def test_text_that_is_no_json_is_refused(text):
    assert refuse(text).startswith("mine.json: the file: Invalid JSON")


def test_a_file_is_one_object():
    assert refuse("[]") == "mine.json: the file: Input should be an object"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"x": [-0.1, 0.2, 0.0]}, "curve: x does not increase"),
        ({"x": [-0.1, 0.0, 0.0]}, "curve: x does not increase"),
        ({"value": [1.0, 2.0]}, "curve: 2 values for 3 points"),
        ({"lo": [1.0, 2.0]}, "curve: 2 values for 3 points"),
        ({"hi": [1.0, 2.0, 3.0, 4.0]}, "curve: 4 values for 3 points"),
        ({"value": [0.0, float("nan"), 1.0]}, "curve.value.1: Input should be a finite number"),
        ({"x": [0.0, 1.0, float("inf")]}, "curve.x.2: Input should be a finite number"),
        ({"x": [0.0], "value": [1.0]}, "curve.x: List should have at least 2 items"),
        ({"x": list(range(1001))}, "curve.x: List should have at most 1000 items"),
        ({"unit": ""}, "curve.unit: String should match pattern"),
        ({"variable": "drive"}, "the curve is over drive, not over velocity"),
        ({"variable": "speed"}, "curve.variable: Input should be 'displacement', "),
        ({"width": 1.0}, "curve.width: Extra inputs are not permitted"),
    ],
)
def test_a_curve_that_is_not_valid_is_refused(curve_content, changes, message):
    curve_content["curve"] |= changes
    assert refuse(curve_content).startswith(f"mine.json: {message}")


def test_a_curve_needs_no_band(curve_content):
    del curve_content["curve"]["lo"], curve_content["curve"]["hi"]
    curve = parse(curve_content).curve
    assert (curve.lo, curve.hi, curve.value) == (None, None, [-5.0, 1.0, 9.0])


def test_an_expression_uses_the_curve_of_its_file(curve_content):
    assert parse(curve_content | {"expression": "2 * curve"}).expression == "2 * curve"
    message = "mine.json: the expression does not use curve"
    assert refuse(curve_content | {"expression": "2 * velocity"}) == message


def test_a_curve_alone_takes_no_parameters(curve_content, content):
    message = "mine.json: the expression does not use base, rise, width"
    assert refuse(curve_content | {"parameters": content["parameters"]}) == message


def test_a_definition_made_in_code_is_checked_likewise(content):
    file = parse(content)
    with pytest.raises(ValidationError, match="belongs to stage damper"):
        EffectFile(**(file.model_dump() | {"stage": "coil"}))


@pytest.fixture
def response(curve_content):
    """Return the content of a valid file with a step response."""
    curve_content["curve"] |= {"variable": "time", "unit": "1", "x": [0.0, 0.01, 0.02]}
    channel = {"stage": "force_channel", "place": "force_channel", "variables": ["force"]}
    return {**curve_content, **channel, "kind": "step_response"}


def test_a_step_response_is_a_function_of_the_time_since_a_change(response):
    assert parse(response).arguments == ["time"]
    a = {"a": {"value": 0.01, "unit": "s", "lo": 0.0, "hi": 1.0}}
    formula = {**response, "curve": None, "parameters": a}
    assert parse(formula | {"expression": "1-exp(-time/a)"}).variables == ["force"]
    message = "mine.json: the expression uses force, which is not declared"
    assert refuse(formula | {"expression": "force+a"}) == message
    response["curve"]["variable"] = "force"
    assert refuse(response) == "mine.json: the curve is over force, not over time"


def test_the_drive_has_a_step_response_over_its_history(response):
    drive = {"stage": "coil", "place": "drive", "variables": ["drive_history"]}
    assert parse(response | drive).arguments == ["time"]


@pytest.mark.parametrize(
    "changes",
    [
        {"variables": ["force", "time"]},
        {"variables": ["time"]},
        {"stage": "coil", "place": "drive", "variables": ["drive"]},
        {"stage": "coil", "place": "field", "variables": ["drive_history"]},
    ],
)
def test_a_step_response_acts_on_drive_or_force_alone(response, changes):
    message = "a step response acts at drive over drive_history or force_channel over force alone"
    assert refuse(response | changes) == f"mine.json: {message}"

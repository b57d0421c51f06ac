import numpy as np
import pytest

from bench.report import diagnosis_plots
from bench.report.diagnosis import Diagnosis
from bench.report.discovery import DiscoveredCurve, Discovery, get_quantity, join_words, make_discovery_context
from tests.support.result_documents import discovery_document


def make_context(named=(), **changes):
    return make_discovery_context(Discovery.model_validate(discovery_document(**changes)), 13.2, list(named))


def draw(drive_unit="V", **changes):
    gap = {"before_n": 13.2, "after_n": 2.6, "noise_floor_n": 2.5}
    found = Diagnosis.model_validate({
        "schema": "mrbench.diagnosis/1", "verdict": "unexplained", "effects": [], "alternatives": [],
        "probability": 0.0, "unknown_probability": 0.9, "gap": gap, "explanation": "",
        "where": {"stage": None, "stages": {}, "map": [], "explainable": 0.5},
        "discovery": discovery_document(**changes),
    })  # fmt: skip
    return diagnosis_plots.plot_discovery(found, drive_unit)


def test_the_sentences_state_place_variables_errors_shrinkage_and_replaced_effects():
    assert make_context(["force_delay"])["text"] == (
        "An effect outside the library acts at the place “parallel force”. "
        "It depends on displacement and velocity. "
        "With it, the force error on held-out strokes falls from 13.2 N to 3.10 N. "
        "With it, the gap of another run is expected to shrink by 92 % (88 % to 95 %). "
        "It replaces force delay, which is not needed with it."
    )


def test_named_effects_that_stay_are_part_of_the_error():
    text = make_context(["coil_lag", "gas_spring"], replaces=[])["text"]
    assert "With it and coil lag and gas spring, the force error" in text
    assert "replaces" not in text


def test_several_replaced_effects_are_listed():
    text = make_context(["coil_lag", "gas_spring"], replaces=["coil_lag", "gas_spring"])["text"]
    assert text.endswith("It replaces coil lag and gas spring, which are not needed with it.")


def test_a_formula_has_symbols_with_values_intervals_and_units():
    context = make_context()
    assert context["formula"] == "added force = sign(velocity)*(a*displacement**2)"
    symbols = {
        "p": {"value": 1.5, "unit": "1", "ci95": [1.4, 1.6]},
        "s": {"value": 0.004, "unit": "m", "ci95": None},
    }
    rows = make_context(formula={"expression": "abs(displacement/s)**p", "symbols": symbols})["symbols"]
    assert rows == [("p", "1.50 ± 0.10", ""), ("s", "4", "mm")]


def test_without_formula_and_shrinkage_the_curve_is_the_result():
    context = make_context(formula=None, shrinkage=None, shrinkage_ci95=None)
    assert (context["formula"], context["symbols"]) == ("", [])
    assert "shrink" not in context["text"]
    assert context["text"].endswith("No short formula does as well as its curve.")


def test_effects_found_after_it_are_listed_with_their_errors():
    assert make_context()["further"] == [("mounting over acceleration", "force error on held-out strokes 2.80 N")]
    assert make_context(further=[])["further"] == []


def test_a_curve_is_drawn_with_its_band_in_the_units_of_the_other_plots():
    first, second = draw().axes
    assert (first.get_xlabel(), first.get_ylabel()) == ("displacement [mm]", "added force [N]")
    assert first.get_title(loc="left") == "parallel force\nover displacement and velocity"
    assert np.allclose(first.lines[0].get_xydata(), [[-10, 4], [0, 0], [10, 4]])
    band = first.collections[0].get_paths()[0].vertices
    assert (band[:, 1].min(), band[:, 1].max()) == (-1.0, 5.0)
    assert (second.get_xlabel(), len(second.collections)) == ("acceleration [m/s²]", 0)


def test_a_step_response_is_named_explained_and_drawn_over_the_time_since_a_change():
    curve = {"variable": "time", "unit": "1", "x": [0.001, 0.01, 0.1], "value": [0.2, 0.9, 1.0]}
    formula = {"expression": "1-(a*exp(-time/s))", "symbols": {}}
    response = {
        "place": "force_channel",
        "variables": ["force"],
        "curve": curve,
        "formula": formula,
        "further": [],
    }
    context = make_context(**response)
    assert "acts at the place “force channel”. It depends on force. The curve is the part of a" in context["text"]
    assert context["formula"] == "step response = 1-(a*exp(-time/s))"
    (axes,) = draw(**response).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time since a change [s]", "step response [1]")
    assert axes.get_title(loc="left") == "step response of the force channel\nover force"
    assert axes.get_xscale() == "log"


def test_a_displacement_error_is_drawn_in_millimetres():
    curve = discovery_document()["curve"] | {"unit": "m", "value": [2e-5, 0.0, 2e-5], "lo": None, "hi": None}
    (axes,) = draw(place="displacement_channel", variables=["displacement"], curve=curve, further=[]).axes
    assert axes.get_ylabel() == "added displacement [mm]"
    assert np.allclose(axes.lines[0].get_ydata(), [0.02, 0.0, 0.02])


@pytest.mark.parametrize(
    ("place", "variables", "unit", "quantity"),
    [
        ("drive", ("time", "drive"), "1", "added drive over drive"),
        ("field", ("drive",), "A", "added field"),
        ("damper_gain", ("time",), "1", "relative change of alpha, c0 and c1"),
        ("mounting", ("acceleration",), "N", "added force"),
        ("mounting", ("force",), "m", "elongation of the mounting"),
        ("displacement_channel", ("velocity",), "m", "added displacement"),
        ("displacement_channel", ("time", "velocity"), "s", "lead of the displacement"),
        ("elsewhere", ("time",), "N", "value at elsewhere"),
    ],
)
def test_the_quantity_of_a_curve_follows_from_its_place(place, variables, unit, quantity):
    curve = discovery_document()["curve"] | {"unit": unit, "variable": variables[0]}
    found = DiscoveredCurve(place=place, variables=variables, curve=curve, rmse_n=1.0)
    assert get_quantity(found, "A") == quantity


def test_a_step_response_of_the_drive_is_not_relative_to_the_drive():
    curve = discovery_document()["curve"] | {"unit": "1", "variable": "time"}
    found = DiscoveredCurve(place="drive", variables=("drive_history",), curve=curve, rmse_n=1.0)
    assert get_quantity(found, "A") == "step response"


def test_names_are_joined_as_in_a_sentence():
    assert join_words(["a_b", "c", "d"]) == "a b, c and d"
    assert (join_words(("a",)), join_words([])) == ("a", "")

"""Comparison of runs on the web page, in a real browser, by mouse and by keyboard."""

import re

import httpx2
import pytest

from bench.comparison import Comparison
from tests.support.fake_comparison import TRUNCATED
from tests.support.fake_page_service import TOKEN, FakeBench, served
from tests.support.page_in_browser import browser_test, operate_page

NOTHING_SELECTED = "Select two or more runs with complete logs to compare them, or any number to analyse them."


@pytest.fixture(scope="module")
def seen():
    """Return what a person sees who compares three runs."""
    found = operate_page(FakeBench(), "compare_runs.mjs")
    rows = {
        name: [row.replace("\n\t", "\t") for row in found[name]] for name in ("drives", "strokes", "parameters")
    }
    return found | rows


def test_the_fake_service_returns_comparisons_of_the_product():
    headers = {"Authorization": f"Bearer {TOKEN}"}
    with served(FakeBench()) as address:
        answer = httpx2.get(f"{address}/api/v1/comparisons?run=run-1&run=run-3&reference=run-1", headers=headers)
    found = Comparison.model_validate(answer.json())
    assert [len(stroke.strokes) for stroke in found.strokes] == [2] * 9
    assert {verdict.result for verdict in found.verdicts} == {"fail"}


@browser_test
def test_runs_are_selected_with_the_keyboard_and_stay_selected_over_a_search(seen):
    assert seen["errors"] == []
    assert seen["nothing"] == [NOTHING_SELECTED, True]
    one = r"1 run is selected, run of .*\. Select the runs to compare with it, or analyse it\."
    assert re.fullmatch(one, seen["one"][0])
    assert (seen["one"][1], seen["truncated"]) == (True, True)
    assert sorted(seen["kept"]) == ["run-1", "run-3"]
    assert seen["two"].startswith("2 runs are selected; the others are compared with run of 2025-03-04")
    assert seen["address"] == "#/compare?run=run-1&run=run-3"


@browser_test
def test_a_run_leads_to_the_list_in_which_it_is_selected(seen):
    assert seen["cleared"] == seen["nothing"][0]
    assert seen["from"] == ["#/runs?compare=run-2", True]


@browser_test
def test_warnings_come_first_and_name_both_values_with_units(seen):
    assert seen["order"][0] == "Conditions"
    found = [re.sub(r"^(\w): .*? \d\d:\d\d:\d\d\. ", r"\1 ", text) for text in seen["warnings"]]
    assert found[0].startswith("B Temperature: 22 °C against 26.5 °C (A against B) in 5mm_2.5Hz_0V")
    assert any(re.match(r"C Stroke: 12\.00 mm against 13\.20 mm \(A against C\)", text) for text in found)
    assert any(re.match(r"C Preload: −?0\.\d N against 2\d\.\d N", text) for text in found)
    assert seen["all"] > len(found)


@browser_test
def test_the_overlay_tells_runs_apart_by_colour_line_and_marker(seen):
    assert seen["captions"][:3] == [
        "Force [N] against displacement [mm]", "Force [N] against velocity [mm/s]", "Force [N] against phase [°]",
    ]  # fmt: skip
    assert [text[:10] for text in seen["legend"]] == ["A: MR-0042", "B: MR-0042", "C: MR-0042"]
    for style in zip(*seen["styles"], strict=True):
        assert len(set(style)) == 3
    assert min(seen["painted"]) > 100


@browser_test
def test_each_drive_and_stroke_passes_or_fails_with_its_margin(seen):
    assert seen["drives"] == [f"{drive} V\tpass\n3 strokes\tfail\n3 strokes" for drive in ("0", "0.2", "0.4")]
    assert len(seen["strokes"]) == 9
    cells = seen["strokes"][0].split("\t")
    assert re.match(r"1\. 5mm_2\.5Hz_0V\s+± 5\.00 mm, 2\.5 Hz, 0 V", cells[0])
    assert re.fullmatch(r"pass\nmargin \d+\.\d N, 100 % inside", cells[1])
    assert re.fullmatch(r"fail\nmargin −\d+\.\d N, \d+(\.\d)? % inside", cells[2])
    assert "by 10 % of its peak force and by half of the 95 % band of its fit" in seen["band"]


@browser_test
def test_peaks_energies_and_parameters_stand_side_by_side(seen):
    assert re.search(r"\d+\.\d / −\d+\.\d\n[\d.]+ mm/s, 22\.0 °C", seen["peak"])
    assert re.search(r"\d\.\d+ ± [\d.]+\n\d cycles, \+\d+\.\d % against A", seen["energy"])
    damping, stiffness = seen["parameters"]
    assert re.match(r"c0 a\tN s/m\t700\n695 … 705\t735\n730 … 740\tdiffers", damping)
    assert stiffness.endswith("agrees")
    assert seen["missing"].startswith("Without a fit: C.")


@browser_test
def test_stroke_reference_and_tolerance_stand_in_the_address_and_survive_a_reload(seen):
    assert seen["chosen"].endswith("&reference=run-1&tolerance=60&stroke=12mm_1.25Hz_0.4V")
    assert seen["focusStays"] == "number"
    assert seen["reloaded"] == ["60", seen["option"]]
    assert "reference" not in seen["without"]
    assert seen["removed"] == "#/compare?run=run-1&run=run-3&stroke=12mm_1.25Hz_0.4V"


@browser_test
def test_all_numbers_follow_the_chosen_units(seen):
    converted = seen["converted"]
    assert converted["captions"][:2] == [
        "Force [lbf] against displacement [in]",
        "Force [lbf] against velocity [in/s]",
    ]
    assert any("Stroke: 0.472 in against 0.520 in" in text for text in converted["warnings"])
    assert any(re.search(r"Preload: −?0\.\d\d lbf against 5\.\d\d lbf", text) for text in converted["warnings"])
    assert "± 0.197 in, 2.5 Hz, 0 V" in converted["option"]


@browser_test
def test_a_comparison_that_is_not_possible_says_why_and_what_to_do(seen):
    repair = "Repair this log in the view of its run, or choose other runs."
    assert seen["problems"] == {
        "run=run-1": "A comparison needs two or more runs. Select them in the list of runs, and press Compare.",
        "run=run-1&run=run-9": "The runs cannot be compared: there is no run run-9. Choose other runs.",
        "run=run-1&run=run-0": f"The runs cannot be compared: {TRUNCATED}. {repair}",
    }


@browser_test
def test_comparison_and_selection_are_accessible_in_all_widths_and_both_schemes(seen):
    assert {view: found for view, found in seen["findings"].items() if found} == {}

"""Editor of methods in the web page, in a real browser: form, problems beside their fields, JSON, storage."""

import json

import pytest

from bench.methods import compile_method, load_method, parse_method
from tests.support.fake_page_service import FakeBench
from tests.support.page_in_browser import browser_test, operate_page


@pytest.fixture(scope="module")
def bench():
    return FakeBench()


@pytest.fixture(scope="module")
def seen(bench):
    """Return what a person sees who edits a copy of the method `quick`."""
    return operate_page(bench, "edit_method.mjs")


@browser_test
def test_the_form_has_all_keys_with_the_units_of_the_person(seen):
    assert seen["errors"] == []
    assert seen["address"] == "#/plan/quick/edit"
    assert {
        "Name",
        "Centre [mm]",
        "Fade [s]",
        "Cycles",
        "Checkpoint",
        "Kind",
        "Amplitude [mm]",
        "Frequency [Hz]",
    } <= set(seen["labels"])
    assert seen["amplitude"] == "10"


@browser_test
def test_no_state_of_the_editor_has_a_finding_of_axe_core_or_of_size(seen):
    assert {state: found for state, found in seen["findings"].items() if found} == {}


@browser_test
def test_a_problem_is_shown_beside_its_field_and_nothing_is_stored(seen, bench):
    problems = seen["problems"]
    assert problems["limit"][0] == "Amplitude [mm]"
    assert "displacement 0.04 m exceeds the limit of 0.025 m" in problems["limit"][1]
    assert problems["missing"] == ["Corner acceleration [m/s²]", "is missing"]
    assert problems["list"][0] == "Levels, separated by commas [V]"
    assert problems["json"].startswith("The form cannot show this document")
    assert sum(path == "methods" for path, _ in bench.posted) == 1


@browser_test
def test_common_values_stay_when_the_kind_of_motion_or_drive_is_changed(seen):
    assert seen["kept"] == "15"
    assert seen["inAmperes"] == "0, 0.2, 0.4"


@browser_test
def test_segments_are_duplicated_moved_and_removed(seen):
    first, second, third = (segment.name for segment in load_method("quick").segments)
    copy = f"{first}_copy"
    assert seen["duplicated"] == [f"1: {first}", f"2: {copy}", f"3: {second}", f"4: {third}"]
    assert seen["moved"] == [f"1: {copy}", f"2: {first}", f"3: {second}", f"4: {third}"]
    assert seen["removed"] == [f"1: {first}", f"2: {second}", f"3: {third}"]


@browser_test
def test_form_and_json_show_the_same_draft_which_survives_a_reload(seen):
    assert (seen["rate"], seen["draft"]) == ("2000", "2000")


@browser_test
def test_the_stored_method_is_the_edited_copy_in_si(seen, bench):
    assert seen["stored"] == ["Stored as version 2 of quick_wide.", "#/plan/quick_wide"]
    (document,) = (json.loads(body) for path, body in bench.posted if path == "methods")
    method = parse_method(document, "the stored document")
    assert compile_method(method).rate == 2000
    expected = load_method("quick").model_dump(mode="json", by_alias=True, exclude_defaults=True)
    motion = {"kind": "triangle", "amplitude_m": 0.015, "frequency_hz": 1.0, "corner_acceleration_mps2": 4.0}
    drive = {"kind": "staircase", "levels": [0.0, 0.2, 0.4]}
    expected["segments"][0] |= {"motion": motion, "drive": drive}
    expected |= {"name": "quick_wide", "rate_hz": 2000.0}
    expected["conditioning"]["between"] = {"rest_s": 1.5}
    assert method.model_dump(mode="json", by_alias=True, exclude_defaults=True) == expected


@browser_test
def test_a_new_method_begins_with_a_valid_one_and_a_draft_can_be_discarded(seen):
    assert seen["fresh"] == ["#/plan/new", "New method", "0.393701"]
    assert seen["discarded"] == "0.393701"

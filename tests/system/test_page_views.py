"""Views of the web page at their addresses, in a real browser: content and accessibility."""

import re

import pytest

from tests.support.fake_page_service import BAD_CELL, TRIP, FakeBench
from tests.support.page_in_browser import browser_test, operate_page


@pytest.fixture(scope="module")
def seen():
    """Return what a person with bookmarks sees in each view."""
    bench = FakeBench()
    found = operate_page(bench, "open_views.mjs")
    return found | {"uploads": [body for path, body in bench.posted if path == "logs"]}


@browser_test
def test_every_view_opens_by_its_address_in_a_new_tab(seen):
    assert seen["errors"] == []
    assert seen["titles"] == {
        "#/bench": "Bench",
        "#/plan/quick": "Plan",
        "#/runs": "Runs",
        "#/runs/run-1": "MR-0042, quick",
        "#/runs/run-1/report": "MR-0042, quick",
    }


@browser_test
def test_the_address_of_a_report_survives_signing_in_and_a_reload(seen):
    assert seen["addressAfterSignIn"] == "#/runs/run-1/report"
    assert seen["report"].startswith("Damper report")


@browser_test
def test_no_view_has_a_finding_of_axe_core(seen):
    assert {view: found for view, found in seen["violations"].items() if found} == {}


@browser_test
def test_all_controls_are_high_enough_for_a_gloved_thumb_and_nothing_needs_a_sideways_scroll(seen):
    assert {view: small for view, small in seen["small"].items() if small} == {}
    assert {view: width for view, width in seen["overflow"].items() if width} == {}


@browser_test
def test_a_run_shows_its_facts_with_the_zone_of_times_and_the_tables_of_its_fit(seen):
    assert re.search(r"2025-03-04 \d\d:11:30 UTC", seen["facts"])
    assert "1.04 times the noise floor" in seen["facts"]
    assert seen["tables"] == [
        "Effects that the simulation lacks",
        "Where the gap appears: force error beyond the noise",
        "Residual by condition; noise floor 2.49 N",
        "Parameters of the modified Bouc-Wen law",
        "Force error by drive; noise floor 2.49 N",
    ]
    assert seen["drives"] == ["0", "0.1", "0.2", "0.3", "0.4", "0.5"]


@browser_test
def test_a_planned_method_is_used_on_the_bench(seen):
    assert "coil voltage" in seen["planFacts"]
    assert "± 25 mm" in seen["planFacts"]
    assert seen["focused"] == "Bench"


@browser_test
def test_a_plan_forecasts_peaks_beside_limits_heat_disk_and_what_is_identifiable(seen):
    assert re.search(r"Force, at most\s+[\d.]+ N\s+\d+ N\s+5000 N", seen["forecast"])
    assert re.search(r"Heat in the damper at most [\d.]+ J, [\d.]+ W on average", seen["forecast"])
    assert "The log needs up to 8.9 MB; the disk has 42 GB free" in seen["forecast"]
    assert "k0 to 3 % (standard deviation)" in seen["forecast"]


@browser_test
def test_units_are_chosen_by_the_person_and_kept(seen):
    assert seen["units"][:3] == [" lbf", " in", " in/s"]
    assert seen["captions"] == ["Force [lbf] against displacement [in]", "Force [lbf] against velocity [in/s]"]


@browser_test
def test_the_keyboard_reaches_a_run_from_the_navigation(seen):
    assert seen["walked"] == "#/runs/run-3"


@browser_test
def test_a_trip_is_large_and_audible_in_every_view_until_it_is_silenced(seen):
    assert TRIP in seen["trip"]
    assert seen["silenced"]
    assert seen["bannerStays"]


@browser_test
def test_a_new_tab_lists_the_stored_events_once_with_those_that_arrive(seen):
    assert len(seen["events"]) == seen["storedEvents"] > 1
    assert all("state: the agent is ready" in event for event in seen["events"])
    assert all(re.match(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d UTC", event) for event in seen["events"])


@browser_test
def test_recordings_are_imported_by_a_button_and_by_dropping_them_onto_a_view(seen):
    assert seen["refusedImport"] == f"Not imported: {BAD_CELL}."
    assert seen["uploadLeft"]
    assert seen["dropped"].splitlines() == ["one.csv, 0.0 MB", "two.csv, 0.0 MB"]
    assert seen["imported"] == ["MR-0099, one, two", "#/runs/run-5"]


@browser_test
def test_units_and_senses_of_imported_files_are_sent_where_they_differ(seen):
    fields = [re.findall(r'name="(unit|reverse)"\r\n\r\n(\S+)', body) for body in seen["uploads"]]
    assert fields == [[], [("unit", "displacement_m=mm"), ("unit", "force_n=kN"), ("reverse", "force_n")]]

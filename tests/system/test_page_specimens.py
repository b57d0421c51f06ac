"""Specimens in the web page, in a real browser: history, trend with its cause, facts and a conflicting change."""

import json
import re

import pytest

from bench.service.views import Run
from tests.support.fake_page_service import FakeBench
from tests.support.fake_specimens import EXPLANATION, IDS, SERIAL, add_history
from tests.support.page_in_browser import browser_test, operate_page


@pytest.fixture(scope="module")
def bench():
    bench = FakeBench()
    add_history(bench)
    return bench


@pytest.fixture(scope="module")
def seen(bench):
    """Return what a person sees who follows a specimen over its runs."""
    return operate_page(bench, "follow_specimen.mjs")


def test_the_runs_of_the_fake_specimen_have_the_type_of_the_service():
    bench = FakeBench()
    add_history(bench)
    runs = [Run.model_validate_json(json.dumps(bench.runs[run_id])) for run_id in IDS]
    assert {run.specimen for run in runs} == {SERIAL}


@browser_test
def test_the_list_names_serial_description_runs_and_last_run(seen):
    assert seen["errors"] == []
    rows = {row.split("\t")[0].strip(): row.split("\t")[1:] for row in seen["list"]}
    assert rows[SERIAL][:3] == ["Endurance damper, serviced in January", "RD-8040-1", "8"]
    assert re.fullmatch(r"2025-02-24 \d\d:15:00", rows[SERIAL][3].strip())
    assert rows["MR-0042"][2] == "4"


@browser_test
def test_the_keyboard_reaches_a_specimen_and_a_search_has_an_address(seen):
    assert seen["walked"] == f"#/specimens/{SERIAL}"
    assert seen["here"] == "Specimens"
    assert seen["found"] == [SERIAL, "#/specimens?text=endurance"]


@browser_test
def test_no_state_of_the_views_has_a_finding_of_axe_core_or_of_size(seen):
    assert {state: found for state, found in seen["findings"].items() if found} == {}


@browser_test
def test_without_a_trend_the_parameters_of_the_fits_are_shown_and_it_is_requested(seen, bench):
    assert seen["fitQuantities"] == ["alpha a [N/m]", "k0 [N/m]"]
    assert (f"specimens/{SERIAL}/trend", "") in bench.posted
    assert seen["progress"] == pytest.approx(0.4)
    assert seen["mayCancel"]
    assert seen["request"].startswith("Trend over 8 runs, computed 2025-02-25")


@browser_test
def test_the_trend_names_its_cause_and_the_quantity_that_changes_most(seen):
    assert seen["cause"] == EXPLANATION
    assert seen["chosen"] == "gas_spring.preload"
    interval = (
        "Drift −6.01 N per run, 95 % interval −6.3 … −5.72 N per run, constant up to run 4, linear from there."
    )
    assert seen["drift"] == interval
    preload = seen["changes"][0].split("\t")
    assert preload[:4] == ["gas spring, preload", "falling", "run 5", "−6.01\u00a0N per run"]
    assert preload[5] == "100.6\u00a0N … 76.1\u00a0N"


@browser_test
def test_an_outlier_is_named_and_values_have_units_and_intervals(seen):
    assert re.search(r"Outlier: run 3 of 2025-02-07 \d\d:15:00 UTC\S* is farther from the line", seen["outlier"])
    assert re.search(r"Without it: no drift shows: −0\.\d+ N/m per run", seen["outlier"])
    assert "The trend calls k0 steady." in seen["outlier"]
    third = seen["values"][2].split("\t")
    assert (third[0], third[2], third[3], third[5]) == ("run 3", "1010", "1004 … 1016", "outlier")
    assert seen["figure"] == "k0 [N/m]: value of each run with its 95 % interval, line of the drift dashed; 8 runs"


@browser_test
def test_the_choice_is_in_the_address_and_survives_a_reload(seen):
    assert seen["address"] == f"#/specimens/{SERIAL}?quantity=k0&over=time"
    assert seen["reloaded"] == "k0"
    assert re.search(r"Drift −1\.75 N per day", seen["perDay"])


@browser_test
def test_a_conflicting_change_is_explained_and_nothing_is_lost(seen):
    assert seen["formFocus"] == "description"
    assert "Kind of damper is now “RD-8041”" in seen["conflict"]
    assert seen["rebased"] == "RD-8041"
    stored = seen["stored"]
    assert (stored["description"], stored["damper_kind"]) == ("Second service in March", "RD-8041")
    assert stored["limits"] == {
        "stroke_m": 0.02, "force_n": 1500.0, "velocity_mps": None, "drive": None, "temperature_c": None
    }  # fmt: skip
    assert seen["afterSave"] == "Edit facts"
    assert "0.7874 in" in seen["facts"]
    assert "1500 N" in seen["facts"]


@browser_test
def test_run_list_and_run_lead_to_the_specimen_and_its_history_to_the_runs(seen):
    assert seen["fromRuns"] == seen["fromRun"] == f"#/specimens/{SERIAL}"
    assert len(seen["history"]) == 8
    assert "explained: gas spring" in seen["history"][0]


@browser_test
def test_a_trend_that_cannot_be_made_is_explained(seen):
    assert seen["tooFew"] == "A trend needs 3 runs with a complete log; this specimen has 1."
    assert seen["noButton"]
    assert seen["unknown"].startswith("The specimen cannot be shown")

"""Results and records of a run in the web page, in a real browser."""

import json
import re

import pytest

from bench.methods import load_method
from tests.support.fake_page_service import REFUSAL, FakeBench
from tests.support.fake_results import CHANGED
from tests.support.page_in_browser import browser_test, operate_page


@pytest.fixture(scope="module")
def bench():
    """Return the fake bench that the page has operated."""
    return FakeBench()


@pytest.fixture(scope="module")
def seen(bench):
    """Return what a person sees who reads a run, keeps records on it and starts its next stroke."""
    return operate_page(bench, "read_run.mjs")


@browser_test
def test_no_part_has_a_finding_of_axe_core_a_small_control_or_a_sideways_scroll(seen):
    assert seen["errors"] == []
    assert {part: found for part, found in seen["violations"].items() if found} == {}
    assert {part: small for part, small in seen["small"].items() if small} == {}
    assert seen["overflow"] == {"telephone": 0}


@browser_test
def test_a_run_shows_measured_over_simulated_force_of_the_worst_segment_with_units(seen):
    assert seen["segment"] == "10mm_1Hz_0.2V: 10 mm, 1 Hz, 0.2 V"
    assert seen["figures"][-3:] == [
        "Force over time.: force [N] over time [s]",
        "Force against displacement.: force [N] over displacement [mm]",
        "Force against velocity.: force [N] over velocity [mm/s]",
    ]
    assert seen["drawn"] == [True] * 6
    assert seen["figuresInLbf"][-3] == "Force over time.: force [lbf] over time [s]"


@browser_test
def test_the_residual_of_each_condition_stands_beside_the_noise_floor(seen):
    rows = [row.split("\t") for row in seen["residuals"]]
    assert rows[0] == ["10mm_1Hz_0V", "5 mm", "1 Hz", "0 V", "2.55", "1.02", "−0.2", "yes", "8000"]
    assert rows[1][4:8] == ["4.1", "1.65", "0.6", "no"]


@browser_test
def test_a_diagnosis_is_told_in_words_with_its_curves_and_what_remains(seen):
    told = seen["diagnosis"]
    assert "The simulation lacks effects, and the diagnosis names some of them." in told
    assert re.search(r"gas spring\s+damper, parallel force\s+97.2 %\s+100 % \(91 % … 100 %\)\s+preload 89 N", told)
    assert "96.8 % (95 % interval 92 % to 98.9 %)" in told
    assert "0.41 N beyond the noise, most probably in the mounting." in told
    assert seen["figures"][0].startswith(
        "Gap over the stroke at 12 mm, 1.25 Hz, 0.266 V.: gap beyond the noise [N]"
    )
    assert seen["figures"][1] == (
        "Effect at the damper gain.: relative change of alpha, c0 and c1 over displacement [mm]"
    )


@browser_test
def test_the_proposed_stroke_is_started_after_a_question_and_a_refusal_says_why(seen, bench):
    assert "Proposed next stroke: sine of 8 mm, 2 Hz, 12 cycles at 0.25 V." in seen["nextStroke"]
    assert "It separates “gas spring” and “gas spring and fixture compliance”" in seen["nextStroke"]
    assert "It is stored as quick_extended." in seen["startQuestion"]
    assert "The rod moves: the specimen MR-0042 has to be clamped" in seen["startQuestion"]
    assert seen["refusedStart"] == f"Not started: {REFUSAL}."
    assert seen["afterStart"] == ["#/bench", "stop"]
    method = bench.methods["quick_extended"]
    assert method.segments[-1].name == "next_stroke_1"
    assert method.segments[:-1] == load_method("quick").segments
    started = [json.loads(body) for path, body in bench.posted if path == "runs"][-1]
    wanted = {"method": "quick_extended", "method_version": 2, "specimen": "MR-0042", "operator": "E. Noether"}
    assert started == wanted


@browser_test
def test_notes_and_tags_are_added_with_their_author_and_never_overwrite_another_person(seen):
    assert seen["refusedTag"] == f"Not changed: {CHANGED}."
    assert seen["tags"] == ["seal"]
    first, tags, last = ([line for line in note.splitlines() if line] for note in seen["notes"])
    assert re.fullmatch(r"2025-03-04 \d\d:20:00 UTC\S*, M. Curie", first[0])
    assert first[1] == "Seal leaks a little."
    assert tags[1] == "tags: seal"
    assert last[0].endswith(", E. Noether")
    assert last[1] == "Warm before the run."


@browser_test
def test_files_are_listed_with_size_and_hash(seen):
    rows = [row.split("\t") for row in seen["files"]]
    assert rows[0][:3] == ["run-1.mcap", "log", "3.5 MB"]
    assert rows[0][4] == "5f" * 32
    assert rows[-1][2] == "made at its request"


@browser_test
def test_events_are_listed_with_their_time_in_the_recording(seen):
    head, checkpoint, alarm = (row.split("\t") for row in seen["events"])
    assert (head[0], head[2]) == ("Time in the recording [s]", "Event")
    assert re.fullmatch(r"When \(UTC\S*\)", head[1])
    assert checkpoint[0] == "11.0"
    assert checkpoint[2] == "checkpoint: after 10mm_1Hz_0V"
    assert (alarm[0], alarm[2]) == ("15.0", "alarm: temperature 61 °C")
    assert re.fullmatch(r"2025-03-04 \d\d:11:45", alarm[1])


@browser_test
def test_a_run_is_trashed_after_a_question_that_leaves_stop_usable_and_restored(seen, bench):
    assert "Nothing is deleted." in seen["question"]
    assert seen["stopInQuestion"]
    assert seen["keptAfterEscape"]
    assert "Restore" in seen["actionsInTrash"]
    assert "Identify" not in seen["actionsInTrash"]
    assert bench.runs["run-1"]["trashed"] is None


@browser_test
def test_a_run_without_results_says_why_and_what_to_do(seen):
    assert seen["missing"] == {
        "run-0": [
            "No diagnosis: the log has no end. Repair log keeps what was recorded.",
            "No fit: the log has no end. Repair log keeps what was recorded.",
        ],
        "run-2": [
            "No diagnosis: it follows the fit.",
            "No fit yet: identify running: identify: refine, start 3 of 8.",
        ],
        "run-3": [
            "No diagnosis: it follows the fit.",
            "No fit: identify failed: the worker was killed. Identify requests it again.",
        ],
    }

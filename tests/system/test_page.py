"""Web page of the service in a real browser, with a fake service that sends fixed replies and moving samples."""

import json
import re
from itertools import pairwise

import pytest

from bench.agent_protocol import AgentStatus
from bench.service.routes.planning.views import MethodSummary
from bench.service.views import Run
from tests.support.fake_page_service import (
    CLAMPED,
    METHODS,
    REFUSAL,
    SILENCE,
    STATIC,
    TRIP,
    FakeBench,
)
from tests.support.page_in_browser import browser_test, operate_page


@pytest.fixture(scope="module")
def bench():
    return FakeBench()


@pytest.fixture(scope="module")
def seen(bench):
    """Return what the page shows while a user signs in, starts, stops, resets, and loses the agent."""
    return operate_page(bench, "look_at_page.mjs")


def test_the_fake_service_replies_with_the_types_of_the_service():
    bench = FakeBench()
    bench.begin({"method": "quick", "specimen": "MR-0042", "operator": "A. Meyer"})
    AgentStatus.model_validate(bench.status())
    for run in bench.runs.values():
        Run.model_validate_json(json.dumps(run))
    for method in METHODS:
        MethodSummary.model_validate(method)


@browser_test
def test_the_token_is_requested_and_removed_from_the_address(seen):
    assert "token" not in seen["address"]
    assert seen["errors"] == []


@browser_test
def test_all_plots_move_and_all_readings_have_units(seen):
    assert seen["canvases"] == 6
    units = {"Force": "N", "Displacement": "mm", "Velocity": "mm/s", "Coil voltage": "V", "Coil current": "A",
             "Temperature": "°C"}  # fmt: skip
    lines = [reading.splitlines() for reading in seen["readings"]]
    assert {line[0]: line[1].split()[-1] for line in lines} == units
    assert {line[0]: line[2] for line in lines}["Displacement"] == "−10.00 … 10.00"
    assert {line[0]: line[3:] for line in lines}["Displacement"] == [
        "end stop −60.00\u00a0mm: 50.00\u00a0mm left",
        "end stop 60.00\u00a0mm: 50.00\u00a0mm left",
        "stop at ±26.25\u00a0mm: 16.25\u00a0mm left",
        "trip at ±55.00\u00a0mm: 45.00\u00a0mm left",
    ]


@browser_test
def test_runs_and_instruments_show_their_errors(seen):
    lossy, identified, done, truncated = seen["runs"]
    assert "12 samples of force were lost" in lossy
    assert "refine, start 3 of 8" in identified
    assert "1.31\u00a0N / 1.26\u00a0N" in done
    assert "1.04 times the noise floor" in done
    assert "The recording was cut off. Repair keeps what was recorded." in truncated
    assert "no reply for 83 s" in seen["instruments"][-1]
    assert "1 min 23 s" in seen["instruments"][-1]


@browser_test
def test_a_refusal_is_shown_next_to_the_start_button(seen):
    assert seen["refusal"] == f"Not started: {REFUSAL}."


@browser_test
def test_a_run_shows_its_progress_and_moves_the_focus_to_stop(seen, bench):
    assert seen["progress"] == ["sine_10mm_1Hz, cycle 3 of 10", "9 s left of 14 s", pytest.approx(5 / 14)]
    assert seen["focused"] == "stop"
    assert seen["startWhileRunning"]
    wanted = {"method": "quick", "specimen": "MR-0042", "operator": "A. Meyer"}
    assert [json.loads(body) for path, body in bench.posted if path == "runs"] == [wanted, wanted]


@browser_test
def test_in_a_text_field_escape_stops_and_space_types(seen, bench):
    assert seen["stateAfterSpaceInField"] == "Running"
    assert seen["specimen"].endswith(" ")
    assert seen["stopped"] == "/api/v1/runs/run-4/stop"
    assert [path for path, _ in bench.posted].count("runs/run-4/stop") == 1
    assert seen["trip"] == TRIP


@browser_test
def test_reset_needs_confirmation(seen, bench):
    assert seen["stateAfterKeeping"] == "Tripped"
    assert [path for path, _ in bench.posted].count("bench/reset") == 1


@browser_test
def test_a_cancelled_job_stays_in_the_list_and_the_answer_is_shown(seen, bench):
    assert ("jobs/job-run-2/cancel", "") in bench.posted
    assert "identify cancelled" in seen["cancelled"]
    assert "The job was cancelled." in seen["cancelled"]


@browser_test
def test_setup_steps_are_sent_to_the_agent_and_homing_needs_confirmation(seen, bench):
    steps = [json.loads(body) for path, body in bench.posted if path == "bench/prepare"]
    assert steps == [
        {"step": "move", "position_m": pytest.approx(0.0125)},
        {"step": "mount", "position_m": 0},
        {"step": "home", "position_m": 0},
    ]
    assert seen["homing"] == f"Nothing was done: {CLAMPED}."
    assert seen["prepareWhileRunning"]
    assert seen["nextStep"].startswith("Move the rod to the specimen's middle")


@browser_test
def test_a_lost_connection_greys_the_values_and_shows_the_reason(seen):
    message, stopped = seen["lost"]
    assert re.fullmatch(r"No data for \d+ s\. Trying again: " + re.escape(SILENCE) + r"\.", message)
    assert stopped == f"Stop was not confirmed, use the emergency stop of the hardware: {SILENCE}."
    assert seen["greyed"]


@browser_test
def test_the_page_fits_a_tablet_and_a_telephone(seen):
    assert seen["overflow"] == {"1280": 0, "768": 0, "390": 0}
    assert all(place["left"] >= 0 and place["right"] <= int(width) for width, place in seen["stopPlaces"].items())


@browser_test
def test_the_layout_is_stable_while_the_page_loads(seen):
    assert sum(shift["value"] for shift in seen["shifts"]) < 0.01, seen["shifts"]


@browser_test
def test_a_decimated_trace_keeps_all_extremes_and_shows_gaps(seen):
    thinned = seen["thinned"]
    given, times, values = thinned["given"], thinned["times"], thinned["values"]
    newest = len(given) - 1

    assert all(before <= after for before, after in pairwise(times))
    assert len(values) <= 2 * 302
    numbers = [newest + round(time * 1000) for time in times]
    at = {k: value for k, value in zip(numbers, values, strict=True) if value is not None}
    assert all(value == pytest.approx(2 * given[k], rel=1e-6, abs=1e-6) for k, value in at.items())
    assert at[15_123] == 100
    assert values.count(None) == 1
    assert -3 < times[values.index(None)] < -2
    for first in range(14_000, 16_900, 20):
        near = [value for k, value in at.items() if first - 20 <= k < first + 40]
        assert max(near) >= 2 * max(given[first : first + 20]) - 1e-6
        assert min(near) <= 2 * min(given[first : first + 20]) + 1e-6
    assert thinned["recent"]["high"] == 50
    assert thinned["afterRepetition"] == len(given)
    assert thinned["shown"] == [15_000, pytest.approx(1.0, abs=1e-3)]
    assert thinned["afterRestart"] == 1


def schemes():
    """Return the colours of the style sheet in the light and in the dark scheme."""
    blocks = re.findall(r":root \{(.*?)\n *\}", (STATIC / "styles" / "style.css").read_text("utf-8"), re.DOTALL)
    light, dark = (dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})", block)) for block in blocks)
    return {"light": light, "dark": light | dark}


def luminance(colour):
    channels = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one, other):
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_contrast_meets_wcag_aa(scheme):
    colours = schemes()[scheme]
    texts = [(name, back) for name in ("ink", "soft", "good", "fair", "bad") for back in ("card", "page", "mark")]
    texts += [("on-accent", "accent"), ("on-stop", "stop")]
    lines = [(name, "card") for name in ("edge", "accent", "force", "displacement", "drive", "temperature")]

    assert [pair for pair in texts if contrast(*(colours[name] for name in pair)) < 4.5] == []
    assert [pair for pair in lines if contrast(*(colours[name] for name in pair)) < 3] == []

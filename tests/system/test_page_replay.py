"""Replay of a recorded run on the web page, in a real browser, by mouse and by keyboard."""

import pytest

from tests.support.fake_page_service import FakeBench
from tests.support.fake_recording import FRAMES
from tests.support.page_in_browser import browser_test, operate_page


@pytest.fixture(scope="module")
def seen():
    """Return what a person sees who replays a run."""
    return operate_page(FakeBench(), "replay_run.mjs")


@browser_test
def test_a_run_is_replayed_from_its_row_and_from_its_address(seen):
    assert seen["errors"] == []
    assert seen["address"] == "#/runs/run-1/replay"
    assert seen["source"].startswith("Replay of a recording, not live. Played from the samples of the log")
    assert seen["captions"] == ["Force [N] against displacement [mm]", "Force [N] against velocity [mm/s]"]


@browser_test
def test_the_slider_shows_segments_and_events_and_moves_by_mouse_and_keyboard(seen):
    assert seen["marks"] == [
        "10mm_1Hz_0V, from 1.0 s",
        "10mm_1Hz_0.2V, from 12.0 s",
        "checkpoint at 11.0 s: after 10mm_1Hz_0V",
        "alarm at 15.0 s: temperature 61 °C",
    ]
    assert seen["text"] == "12.0 s of 24 s, 10mm_1Hz_0.2V"
    assert seen["atEvent"] == 15.0
    assert seen["clicked"] == pytest.approx(6.0, abs=0.5)
    assert seen["stepped"] == pytest.approx(0.1)


@browser_test
def test_the_text_of_a_mark_is_shown_when_it_is_focused_or_pressed(seen):
    assert seen["segmentText"] == "10mm_1Hz_0.2V, from 12.0 s"
    assert seen["focusedText"] == ["checkpoint at 11.0 s: after 10mm_1Hz_0V", 12.0]
    assert seen["pressedText"] == "alarm at 15.0 s: temperature 61 °C"


@browser_test
def test_a_replay_plays_on_with_further_samples_and_stays_where_it_is_paused(seen):
    assert seen["stayed"]
    assert 12.0 < seen["played"] < 24.0


@browser_test
def test_the_view_says_whether_the_raw_frames_give_the_recorded_readings(seen):
    assert seen["frames"].endswith(FRAMES)


@browser_test
def test_the_replay_is_accessible_and_leaves_stop_in_reach(seen):
    assert seen["findings"] == []
    assert seen["stopIsThere"]

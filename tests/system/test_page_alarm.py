"""Sound of a trip at the web page, in a real browser that permits sound only after an operation of the page."""

import pytest

from tests.support.fake_page_service import FakeBench
from tests.support.page_in_browser import browser_test, operate_page

OFF = "Sound is off: touch the page"


@pytest.fixture(scope="module")
def seen():
    return operate_page(FakeBench(), "hear_trip.mjs")


@browser_test
def test_a_page_that_nobody_has_touched_says_that_its_sound_is_off(seen):
    assert seen["errors"] == []
    assert OFF in seen["untouched"]["notes"]
    assert seen["tripped"] == {"notes": [OFF, OFF], "tones": 0}


@browser_test
@pytest.mark.parametrize("operation", ["touched", "clicked"])
def test_the_first_touch_or_key_turns_the_sound_on_during_a_trip(seen, operation):
    assert seen[operation]["notes"] == ["", ""]
    assert seen[operation]["tones"] > 0


@browser_test
def test_a_silenced_trip_stays_silent(seen):
    assert seen["silenced"] == 0


@browser_test
def test_a_reload_turns_the_sound_off_again(seen):
    assert seen["reloaded"] == {"notes": [OFF, OFF], "tones": 0}

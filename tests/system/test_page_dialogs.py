"""Stop stays reachable in the web page while a dialog is open, in a real browser."""

import pytest

from tests.support.fake_page_service import FakeBench
from tests.support.page_in_browser import browser_test, operate_page

WAYS = [f"{dialog} {way}" for dialog in ("home-dialog", "reset-dialog") for way in ("Escape", "Space", "click")]


@pytest.fixture(scope="module")
def seen():
    """Return what happens when a run starts while a dialog is open, and a person stops it."""
    return operate_page(FakeBench(), "stop_in_dialogs.mjs")


@browser_test
def test_escape_space_and_the_button_stop_with_any_dialog_open(seen):
    assert seen["errors"] == []
    assert [way for way in WAYS if not seen["stops"][way][0]] == []


@browser_test
def test_the_escape_that_stops_leaves_the_dialog_open_and_the_next_one_closes_it(seen):
    assert [way for way in WAYS if not seen["stops"][way][1]] == []
    assert seen["left"] == dict.fromkeys(WAYS, True)


@browser_test
def test_stop_is_sent_while_the_page_asks_for_a_token(seen):
    assert seen["stops"]["sign-in-dialog Escape"] == [True, True]

"""Sign-in, rights, people and tokens of the web page, in a real browser."""

import json
import re

import pytest

from tests.support.fake_page_service import FakeBench
from tests.support.page_in_browser import browser_test, operate_page


@pytest.fixture(scope="module")
def bench():
    """Return the fake bench that the people use."""
    return FakeBench()


@pytest.fixture(scope="module")
def seen(bench):
    """Return what people with different roles see."""
    return operate_page(bench, "use_account.mjs")


@browser_test
def test_no_dialog_and_no_view_has_a_finding(seen):
    assert seen["errors"] == []
    assert {name: found for name, found in seen["findings"].items() if found} == {}
    assert len(seen["findings"]) == 8


@browser_test
def test_sign_in_by_password_returns_to_the_address_that_was_opened(seen):
    assert seen["firstReason"] == ""
    assert seen["refused"] == "Not signed in: the credentials are wrong."
    assert seen["addressAfterSignIn"] == "#/runs/run-1"
    assert seen["account"].split() == ["Lise", "Meitner", "technician"]


@browser_test
def test_after_too_many_failures_the_time_until_the_next_attempt_is_shown(seen):
    assert re.fullmatch(r"Next attempt in [1-4] s\.", seen["wait"])
    assert seen["locked"]


@browser_test
def test_scripts_have_no_secret_in_their_storage(seen):
    local, session, cookie = json.loads(seen["stored"])
    assert cookie == ""
    assert not any("token" in key or "csrf" in key for key in [*local, *session])


@browser_test
def test_a_control_without_its_right_says_which_right_and_who_has_it(seen):
    expected = (
        "You lack the right to trash, restore and repair runs (manage_runs). "
        "The roles engineer and administrator have it."
    )
    assert seen["described"]["trash"] == {"disabled": "true", "text": expected}
    assert seen["detail"] == expected
    assert not seen["asked"]
    assert "(reset_trip)" in seen["described"]["reset"]["text"]
    for control in ("pause", "import", "start"):
        assert seen["described"][control]["disabled"] == "true"
        assert "(operate)" in seen["described"][control]["text"]


@browser_test
def test_stop_and_abort_are_usable_for_a_viewer(seen, bench):
    assert seen["described"]["stop"]["disabled"] is None
    assert seen["described"]["abort"]["disabled"] is None
    assert "runs/run-4/stop" in [path for path, _ in bench.posted]


@browser_test
def test_the_operator_of_a_run_is_the_signed_in_person(seen, bench):
    assert seen["operator"] == "Lise Meitner"
    started = [json.loads(body) for path, body in bench.posted if path == "runs"]
    assert started[-1]["operator"] == "Lise Meitner"


@browser_test
def test_a_view_without_the_right_shows_what_the_service_says(seen):
    assert seen["people403"] == (
        "The people cannot be listed: you lack the right administer, which the role administrator has."
    )


@browser_test
def test_the_keyboard_moves_in_the_menu_and_escape_closes_it(seen):
    first, second, last = "Sign in another device …", "Change my password …", "Sign out"
    assert seen["walked"] == [first, second, last, first, last, first]
    assert seen["afterEscape"] == ["account", True]


@browser_test
def test_an_administrator_adds_changes_and_disables_people(seen, bench):
    people = {row.split()[0]: row for row in seen["people"]}
    assert "also reset_trip" in people["Emmy"]
    assert "disabled" in people["Lise"]
    assert bench.people.passwords["enoether"] == "conserved quantity"
    assert "mcurie is the last administrator" in seen["lastAdministrator"]


@browser_test
def test_a_token_is_shown_once_and_can_be_revoked(seen, bench):
    assert seen["newToken"].startswith("mrb_")
    assert seen["copied"]
    assert seen["hidden"] == ["", False]
    created = next(json.loads(body) for path, body in bench.posted if path == "tokens")
    assert created == {"label": "grafana", "role": "viewer", "expires_in_days": 30}
    assert "revoked" in seen["tokens"][0]
    assert "nightly export" in seen["tokens"][1]


@browser_test
def test_ones_own_password_needs_the_present_one(seen, bench):
    assert seen["wrongPassword"] == "Not saved: give the present password."
    assert bench.people.passwords["mcurie"] == "polonium and radium"


@browser_test
def test_another_device_signs_in_by_a_scanned_or_typed_code(seen):
    assert re.fullmatch(r"Valid for (2 min 00 s|1 min \d\d s), and for one sign-in\.", seen["deviceTime"])
    assert seen["picture"]
    assert seen["scanned"] == ""
    assert seen["typed"] == "#/tokens"


@browser_test
def test_an_ended_session_asks_to_sign_in_and_returns_to_the_view(seen):
    assert seen["expired"].startswith("The session has expired or was ended.")
    assert seen["addressAfterExpiry"] == "#/specimens"


@browser_test
def test_the_page_follows_a_sign_in_of_another_tab(seen):
    assert "by user:vguest" in seen["creator"]

"""Sign-in, rights, people and tokens of the web page, in a real browser."""

import json
import re

import pytest

from bench.audit import find_signatures
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
    assert len(seen["findings"]) == 13


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
def test_what_the_identity_provider_gives_is_not_offered_as_a_field(seen, bench):
    assert "wpauli, of the identity provider" in seen["external"]
    assert "by the identity provider only" in seen["external"]
    assert "Set password" not in seen["external"]
    hidden = ("Full name", "Role", "Name for signing in", "Password")
    assert not any(label.startswith(hidden) for label in seen["externalFields"])
    assert "Full name, role and password come from there" in seen["externalWords"]
    changes = [json.loads(body) for path, body in bench.posted if path == "users/wpauli"]
    assert changes == [{"extra_rights": ["manage_methods"]}]


@browser_test
def test_a_version_of_a_method_is_approved_after_a_question_and_the_approval_is_withdrawn(seen):
    newest, included = (row.split("\t") for row in seen["approved"])
    assert newest[0] == "version 2"
    assert re.match(r"approved\s+by Marie Curie, 2025-03-04 \d\d:20:00 UTC", newest[2].strip())
    assert included[:3] == ["version 1", "included in mrbench", "not approved"]
    assert [row.split("\t")[2].strip() for row in seen["withdrawn"]] == ["not approved"] * 2
    assert "Campaigns in progress keep their methods." in seen["approvalQuestion"]


@browser_test
def test_a_person_reads_a_report_and_signs_exactly_that_file(seen, bench):
    (before,) = seen["signedBefore"]
    assert "Emmy Noether" in before
    assert "Newer results exist; this report does not contain them." in before
    sha256 = seen["toBeSigned"].removeprefix("SHA-256 ")
    assert sha256 in seen["signDialog"]
    assert "You sign as Marie Curie." in seen["signDialog"]
    assert seen["wrongSignature"] == "Not signed: give the present password."
    assert re.fullmatch(r"Signed: approved\. It is entry \d+ of the audit trail\.", seen["signed"])
    after = seen["signedAfter"][1]
    assert all(words in after for words in ("Marie Curie", "approved", sha256, "as signed"))
    assert re.search(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d UTC", after)
    (entry,) = find_signatures(bench.trail.path, sha256)
    assert entry.new["meaning"] == "approved"


@browser_test
def test_the_audit_trail_is_read_searched_verified_and_exported(seen):
    assert len(seen["trail"]) == 50
    signature, stop, refused, change = (row.split("\t") for row in seen["trail"][:4])
    assert signature[3].startswith("report signed")
    assert "entry 2 of the rig agent's own trail, sent by account rig, process 4711" in stop[3]
    assert "from local" in stop[2]
    assert refused[6] == "403 Visiting Guest (viewer) lacks the right operate"
    assert change[2].startswith("user:mcurie")
    assert "MR-0042" in change[3]
    assert [value.strip() for value in change[4:6]] == ["limits", "limits"]
    assert seen["wholeTrail"] == 65
    assert seen["verified"].startswith("Nothing was altered in 65 entries; 1 of them are imported")
    assert seen["exported"] == "audit-65.csv"
    (row,), address = seen["found"]
    assert "report signed" in row
    conditions = r"actor=user%3Amcurie&action=report\+signed&from=2025-03-0\dT\d\d%3A00%3A00\.000Z"
    assert re.fullmatch(rf"#/audit\?{conditions}", address)
    assert seen["kept"] == ["2025-03-05T08:00", "user:mcurie"]


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

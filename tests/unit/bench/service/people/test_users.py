"""Users and tokens of programs."""

import time
from datetime import UTC, datetime, timedelta

import pytest
from sqlalchemy import update

from bench.catalogue import TokenRow
from bench.service.access import authenticator
from tests.unit.bench.service.people.conftest import PASSWORD, Browser


def test_a_user_is_added_and_changed(bench):
    added = bench.send("POST", "/users", {"name": "mcurie", "full_name": "M. Curie", "role": "technician"}).json()
    assert (added["has_password"], added["last_seen"], added["revision"]) == (False, None, 1)
    change = {"role": "engineer", "extra_rights": ["administer"], "full_name": "Marie Curie"}
    changed = bench.send("PATCH", "/users/mcurie", change).json()
    assert (changed["role"], changed["full_name"], changed["revision"]) == ("engineer", "Marie Curie", 2)
    assert "administer" in changed["rights"]
    assert bench.get("/users")["items"] == [changed]


@pytest.mark.parametrize(
    ("body", "status", "text"),
    [
        ({"name": "M Curie", "role": "viewer"}, 422, "small letters"),
        ({"name": "mcurie", "role": "boss"}, 422, "role"),
        ({"name": "mcurie", "role": "viewer", "password": "short"}, 422, "5 characters; give 12 to 200"),
        ({"name": "viewer", "role": "viewer"}, 409, "user viewer exists"),
    ],
)
def test_a_bad_user_is_refused_with_a_reason(people, bench, body, status, text):
    before = bench.get("/users")
    answer = bench.send("POST", "/users", body)
    assert (answer.status_code, text in answer.json()["detail"]) == (status, True), answer.text
    assert bench.get("/users") == before


def test_persons_change_their_own_password_only_with_the_present_one(people, open_browser):
    browser, elsewhere = open_browser("viewer"), open_browser("viewer")
    new = {"password": "another long password"}
    assert browser.send("PATCH", "/users/viewer", new).status_code == 403
    wrong = browser.send("PATCH", "/users/viewer", {**new, "current_password": "wrong password"})
    assert wrong.json()["type"] == "urn:mrbench:problem:wrong-password"
    assert browser.send("PATCH", "/users/viewer", {**new, "current_password": PASSWORD}).status_code == 200
    assert browser.send("GET", "/session").status_code == 200
    assert elsewhere.send("GET", "/session").status_code == 401
    open_browser().sign_in(status=401, name="viewer", password=PASSWORD)
    open_browser().sign_in(name="viewer", password=new["password"])


@pytest.mark.parametrize(
    "change", [{"role": "administrator"}, {"extra_rights": ["administer"]}, {"disabled": True}]
)
def test_nobody_but_an_administrator_changes_rights(people, open_browser, change):
    browser = open_browser("engineer")
    for name in ("engineer", "viewer"):
        answer = browser.send("PATCH", f"/users/{name}", {**change, "current_password": PASSWORD})
        assert answer.json()["type"] == "urn:mrbench:problem:right-missing"
    assert browser.send("PATCH", "/users/viewer", {"password": "another long password"}).status_code == 403


def test_a_removed_user_loses_sessions_and_tokens_also_if_the_name_returns(people, bench, open_browser):
    browser = open_browser("engineer")
    made = browser.send("POST", "/tokens", {"label": "x", "role": "viewer", "expires_in_days": 1}).json()
    assert bench.send("DELETE", "/users/engineer").status_code == 204
    assert bench.send("DELETE", "/users/engineer").status_code == 404
    bench.send("POST", "/users", {"name": "engineer", "role": "engineer", "password": PASSWORD})
    assert browser.send("GET", "/session").status_code == 401
    assert _ask(bench, made["token"]) == 401


def test_a_token_can_do_no_more_than_its_role_and_its_creator(people, bench, open_browser):
    browser = open_browser("engineer")
    body = {"label": "nightly", "role": "engineer", "expires_in_days": 30}
    made = browser.send("POST", "/tokens", body).json()
    assert made["created_by"] == "user:engineer"
    assert _ask(bench, made["token"]) == 200
    assert browser.send("POST", "/tokens", {**body, "role": "administrator"}).status_code == 403
    bench.send("PATCH", "/users/engineer", {"role": "viewer"})
    method = {"name": "quick", "document": {}}
    answer = _send(bench, made["token"], "POST", "/methods", method)
    assert answer.json()["type"] == "urn:mrbench:problem:right-missing"
    bench.send("PATCH", "/users/engineer", {"disabled": True})
    assert _ask(bench, made["token"]) == 401


def test_expired_revoked_and_forged_tokens_are_refused(service, bench):
    body = {"label": "nightly", "role": "viewer", "expires_in_days": 1}
    expired, revoked = (bench.send("POST", "/tokens", body).json() for _ in range(2))
    assert (_ask(bench, expired["token"]), _ask(bench, revoked["token"])) == (200, 200)
    store = service.client.app.state.context.catalogue.tokens
    with store._sessions.begin() as session:
        past = datetime.now(UTC) - timedelta(seconds=1)
        session.execute(update(TokenRow).where(TokenRow.id == expired["id"]).values(expires=past))
    service.client.app.state.context.authenticator.forget()
    bench.send("DELETE", f"/tokens/{revoked['id']}")
    forged = revoked["token"][:-1] + ("A" if revoked["token"][-1] != "A" else "B")
    assert [_ask(bench, token) for token in (expired["token"], revoked["token"], forged)] == [401, 401, 401]
    states = {one["id"]: one["state"] for one in bench.get("/tokens")["items"]}
    assert states == {expired["id"]: "expired", revoked["id"]: "revoked"}


def test_a_change_by_another_process_counts_after_a_moment(people, service, open_browser, monkeypatch):
    monkeypatch.setattr(authenticator, "_KEPT_TIME", 0.2)
    browser = open_browser("viewer")
    service.client.app.state.context.catalogue.users.change("viewer", {"disabled": True})
    time.sleep(0.3)
    assert browser.send("GET", "/runs").status_code == 401


def test_tokens_of_others_are_seen_and_revoked_by_administrators_only(people, bench, open_browser):
    engineer, technician = open_browser("engineer"), open_browser("technician")
    made = engineer.send("POST", "/tokens", {"label": "x", "role": "viewer", "expires_in_days": 1}).json()
    assert technician.get("/tokens")["items"] == []
    assert technician.send("DELETE", f"/tokens/{made['id']}").status_code == 403
    assert [one["id"] for one in bench.get("/tokens")["items"]] == [made["id"]]
    assert engineer.send("DELETE", f"/tokens/{made['id']}").status_code == 204


def _send(bench, token, method, path, json=None):
    program = Browser.__new__(Browser)
    program.client, program.cookie, program.csrf, program.token = bench.client, None, None, token
    return program.send(method, path, json)


def _ask(bench, token):
    return _send(bench, token, "GET", "/runs").status_code

"""Sessions of browsers: cookie, CSRF value, end, failures, and codes for another device."""

from itertools import islice

import pytest
from starlette.websockets import WebSocketDisconnect

from bench.people.attempts import FIRST_WAIT
from tests.unit.bench.service.people.conftest import COOKIE, PASSWORD

LIVE = "ws://127.0.0.1:8600/api/v1/live"


def test_a_person_signs_in_by_password_and_out_again(people, open_browser):
    browser = open_browser("technician")
    session = browser.get("/session")
    assert session["person"]["full_name"] == "The technician"
    assert session["person"]["rights"] == ["view", "stop", "operate", "analyse", "sign_reports"]
    assert session["kind"] == "user"
    assert 11.9 * 3600 < session["expired_in_s"] <= 12 * 3600
    assert browser.send("DELETE", "/session").status_code == 204
    assert browser.send("GET", "/session").status_code == 401
    assert browser.send("GET", "/runs").status_code == 401


def test_scripts_and_other_sites_do_not_receive_the_cookie(people, open_browser):
    answer = open_browser().sign_in(name="viewer", password=PASSWORD)
    attributes = answer.headers["set-cookie"].lower()
    assert attributes.startswith(COOKIE)
    assert "httponly" in attributes
    assert "samesite=strict" in attributes
    assert "path=/api/" in attributes
    assert answer.json()["csrf"] not in attributes


def test_the_secret_of_a_session_is_stored_as_a_hash(people, open_browser, service):
    browser = open_browser("viewer")
    files = list(service.data.glob("catalogue.db*"))
    assert files
    assert not any(browser.cookie.encode() in path.read_bytes() for path in files)
    assert not any(PASSWORD.encode() in path.read_bytes() for path in files)


def test_a_change_needs_the_csrf_value_of_this_session(people, open_browser):
    browser, other = open_browser("administrator"), open_browser("administrator")
    body = {"label": "x", "role": "viewer", "expires_in_days": 1}
    for value in ("", "wrong", "ä", other.csrf):
        answer = browser.send("POST", "/tokens", body, **{"X-CSRF-Token": value.encode()})
        assert answer.status_code == 403, value
        assert answer.json()["type"] == "urn:mrbench:problem:csrf"
    assert browser.get("/tokens")["items"] == []
    assert browser.send("POST", "/tokens", body).status_code == 201


def test_stop_from_another_site_is_refused_too(people, open_browser, service):
    browser = open_browser("viewer")
    assert browser.send("POST", "/bench/abort", **{"X-CSRF-Token": ""}).status_code == 403
    assert service.agent.commands == []


def test_a_token_signs_a_browser_in_until_the_token_ends(bench, open_browser):
    made = bench.send("POST", "/tokens", {"label": "tablet", "role": "technician", "expires_in_days": 1}).json()
    browser = open_browser()
    browser.sign_in(token=made["token"])
    session = browser.get("/session")
    assert (session["kind"], session["person"]["role"]) == ("token", "technician")
    assert bench.send("DELETE", f"/tokens/{made['id']}").status_code == 204
    assert browser.send("GET", "/session").status_code == 401


def test_the_bench_token_signs_a_browser_in(service, open_browser):
    browser = open_browser()
    browser.sign_in(token=service.token)
    assert browser.get("/session")["person"]["role"] == "administrator"
    assert browser.send("POST", "/users", {"name": "mcurie", "role": "engineer"}).status_code == 201


@pytest.mark.parametrize(
    "credentials",
    [
        {"name": "viewer", "password": "wrong password"},
        {"name": "nobody", "password": PASSWORD},
        {"token": "wrong"},
        {"code": "1234-5678"},
    ],
)
def test_wrong_credentials_are_refused_without_a_hint(people, open_browser, credentials):
    answer = open_browser().sign_in(status=401, **credentials)
    assert answer.json()["type"] == "urn:mrbench:problem:sign-in-failed"
    assert "set-cookie" not in answer.headers


@pytest.mark.parametrize(
    "credentials",
    [{}, {"name": "viewer"}, {"password": "x"}, {"token": "a", "code": "b"}, {"name": "a", "token": "b"}],
)
def test_incomplete_credentials_are_explained(open_browser, credentials):
    answer = open_browser().sign_in(status=422, **credentials)
    assert "give name and password, or token, or code" in answer.json()["detail"]


def test_failures_lock_a_name_out_for_a_while_also_with_the_right_password(people, bench, open_browser):
    browser = open_browser()
    for _ in range(5):
        browser.sign_in(status=401, name="viewer", password="wrong password")
    answer = browser.sign_in(status=429, name="viewer", password=PASSWORD)
    assert 0 < int(answer.headers["Retry-After"]) <= FIRST_WAIT
    assert answer.json()["type"] == "urn:mrbench:problem:too-many-attempts"
    locked = {user["name"]: user["locked_until"] for user in bench.get("/users")["items"]}
    assert locked.pop("viewer") is not None
    assert set(locked.values()) == {None}
    open_browser("technician")  # others are not affected


def test_a_disabled_user_is_signed_out_and_cannot_sign_in(people, bench, open_browser):
    browser = open_browser("engineer")
    assert bench.send("PATCH", "/users/engineer", {"disabled": True}).status_code == 200
    assert browser.send("GET", "/runs").status_code == 401
    open_browser().sign_in(status=401, name="engineer", password=PASSWORD)


def test_a_code_signs_another_device_in_once(people, open_browser):
    browser, tablet = open_browser("technician"), open_browser()
    made = browser.send("POST", "/session/codes").json()
    assert made["svg"].startswith("<svg")
    assert made["url"] == f"http://127.0.0.1:8600/#code={made['code'].replace('-', '')}"
    tablet.sign_in(code=made["code"])
    assert tablet.get("/session")["person"]["name"] == "technician"
    open_browser().sign_in(status=401, code=made["code"])


def test_codes_cannot_be_guessed_by_trying(people, open_browser):
    browser, tablet = open_browser("technician"), open_browser()
    made = browser.send("POST", "/session/codes").json()
    for number in range(5):
        tablet.sign_in(status=401, code=f"{number:08}")
    tablet.sign_in(status=429, code=made["code"])


def test_live_data_need_the_csrf_value_beside_the_cookie(people, open_browser, client):
    browser = open_browser("viewer")
    headers = {"Cookie": f"{COOKIE}={browser.cookie}"}
    with client.websocket_connect(LIVE, headers=headers) as socket:
        socket.send_json({"csrf": browser.csrf})
        assert socket.receive_json()["topic"]
    with client.websocket_connect(LIVE, headers=headers) as socket:
        socket.send_json({"csrf": "wrong"})
        with pytest.raises(WebSocketDisconnect) as closed:
            socket.receive_text()
    assert closed.value.code == 4401


def test_live_data_end_with_the_session(people, open_browser, client, monkeypatch):
    monkeypatch.setattr("bench.service.routes.live._CHECK_INTERVAL", 0.05)
    browser = open_browser("viewer")
    with client.websocket_connect(LIVE, headers={"Cookie": f"{COOKIE}={browser.cookie}"}) as socket:
        socket.send_json({"csrf": browser.csrf})
        assert socket.receive_json()["topic"]
        assert browser.send("DELETE", "/session").status_code == 204
        messages = iter(socket.receive, None)
        (closed,) = islice((one for one in messages if one["type"] == "websocket.close"), 1)
    assert closed["code"] == 4401

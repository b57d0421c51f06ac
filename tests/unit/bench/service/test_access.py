"""Access with and without the token."""

import re

import pytest
from starlette.websockets import WebSocketDisconnect

from bench.service.access import TOKEN_FILE, open_access

OPEN = {
    ("GET", "/api/v1/health"),
    ("GET", "/api/v1/openapi.json"),
    ("POST", "/api/v1/session"),
    ("GET", "/api/v1/session/ways"),
    ("GET", "/api/v1/session/oidc"),
    ("GET", "/api/v1/session/oidc/callback"),
}


def routes(client):
    described = client.get("/api/v1/openapi.json").json()["paths"]
    for path, methods in described.items():
        for method in methods:
            yield method.upper(), re.sub(r"\{\w+\}", "any", path)


def test_the_token_is_kept_as_a_hash_readable_by_its_owner_only(tmp_path):
    access, token = open_access(tmp_path)
    assert access.is_allowed(token)
    assert token not in (tmp_path / TOKEN_FILE).read_text()
    assert (tmp_path / TOKEN_FILE).stat().st_mode & 0o777 == 0o600


def test_the_token_is_printed_once_and_stays_valid(tmp_path):
    _, token = open_access(tmp_path)
    again, nothing = open_access(tmp_path)
    assert nothing is None
    assert again.is_allowed(token)
    assert not again.is_allowed(token + "x")
    assert not again.is_allowed("")


def test_a_new_token_makes_the_old_one_invalid(tmp_path):
    _, old = open_access(tmp_path)
    access, new = open_access(tmp_path, new=True)
    assert access.is_allowed(new)
    assert not access.is_allowed(old)
    assert (tmp_path / TOKEN_FILE).stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize("authorization", [None, "Bearer wrong", "Basic dXNlcjpwdw=="])
def test_only_health_description_and_sign_in_are_available_without_the_token(client, authorization):
    del client.headers["Authorization"]
    headers = {} if authorization is None else {"Authorization": authorization}
    closed = [one for one in routes(client) if one not in OPEN]
    assert len(closed) >= 17
    for method, path in closed:
        answer = client.request(method, path, headers=headers, json={})
        assert answer.status_code == 401, (method, path)
        assert answer.headers["content-type"] == "application/problem+json"
        assert answer.json()["type"] == "urn:mrbench:problem:unauthorised"


def test_health_and_description_are_open(client):
    del client.headers["Authorization"]
    answers = (client.get(path) for _, path in OPEN if path.endswith(("health", "json", "ways")))
    assert [answer.status_code for answer in answers] == [200, 200, 200]


@pytest.mark.parametrize("first", ['{"token": ""}', '{"token": "wrong"}', "{}", "wrong"])
def test_the_websocket_is_closed_without_the_token_in_the_first_message(client, first):
    with client.websocket_connect("ws://127.0.0.1:8600/api/v1/live") as socket:
        socket.send_text(first)
        with pytest.raises(WebSocketDisconnect) as closed:
            socket.receive_text()
    assert closed.value.code == 4401


def test_a_token_in_the_address_of_the_websocket_has_no_effect(service, client):
    with client.websocket_connect(f"ws://127.0.0.1:8600/api/v1/live?token={service.token}") as socket:
        socket.send_text("{}")
        with pytest.raises(WebSocketDisconnect) as closed:
            socket.receive_text()
    assert closed.value.code == 4401


def test_a_request_for_another_host_name_is_refused(client):
    assert client.get("/api/v1/health", headers={"Host": "evil.example"}).status_code == 400
    assert client.get("/api/v1/health", headers={"Host": "localhost:8600"}).status_code == 200
    assert client.get("/api/v1/health", headers={"Host": "[::1]:8600"}).status_code == 200

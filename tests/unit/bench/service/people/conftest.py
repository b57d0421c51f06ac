"""Browsers and programs that send requests to one service."""

import pytest

from bench.people import ROLES

PASSWORD = "correct horse battery"
COOKIE = "mrbench_session_8600"


class Browser:
    """Browser with a cookie of its own on the client of a service."""

    def __init__(self, service):
        self.client = service.client
        self.cookie, self.csrf, self.token = None, None, None

    def send(self, method, path, json=None, **headers):
        given = dict(headers)
        if self.token:
            given["Authorization"] = f"Bearer {self.token}"
        if self.cookie:
            given["Cookie"] = f"{COOKIE}={self.cookie}"
        if self.csrf:
            given.setdefault("X-CSRF-Token", self.csrf)
        answer = self.client.request(method, f"/api/v1{path}", json=json, headers=given)
        self.client.cookies.clear()
        return answer

    def sign_in(self, status=201, **credentials):
        answer = self.send("POST", "/session", credentials)
        assert answer.status_code == status, answer.text
        if status == 201:
            self.cookie = answer.headers["set-cookie"].partition("=")[2].partition(";")[0]
            self.csrf = answer.json()["csrf"]
        return answer

    def get(self, path):
        answer = self.send("GET", path)
        assert answer.status_code == 200, answer.text
        return answer.json()


@pytest.fixture
def bench(service):
    """Return a program with the bench's own token."""
    del service.client.headers["Authorization"]
    program = Browser(service)
    program.token = service.token
    return program


@pytest.fixture
def people(bench):
    """Add a user of each role, named like it, and return their names."""
    for role in ROLES:
        body = {"name": role, "full_name": f"The {role}", "role": role, "password": PASSWORD}
        assert bench.send("POST", "/users", body).status_code == 201
    return ROLES


@pytest.fixture
def open_browser(service, bench):
    """Return a function that opens a browser, signed in as a user if a name is given."""

    def open_one(name=None):
        browser = Browser(service)
        if name:
            browser.sign_in(name=name, password=PASSWORD)
        return browser

    return open_one

"""Service on PostgreSQL whose database goes away and comes back."""

import pytest

from bench.catalogue import CATALOGUE_FILE
from tests.unit.bench.service.people.conftest import PASSWORD, Browser

ADMIN = {"name": "anna", "full_name": "Anna", "role": "technician", "password": PASSWORD}


@pytest.fixture
def database(postgres_server):
    return postgres_server.make_catalogue()


@pytest.fixture
def outage(postgres_server, database):
    """Provide a function that takes the database away, or brings it back."""
    yield lambda is_away: postgres_server.allow_connections(database, not is_away)
    postgres_server.allow_connections(database, True)


def test_requests_are_answered_with_the_reason_until_the_database_is_back(service, outage):
    assert service.get("/runs")["items"] == []
    outage(True)
    answer = service.client.get("/api/v1/runs")
    assert answer.status_code == 503
    assert answer.json()["type"] == "urn:mrbench:problem:catalogue-unavailable"
    assert "cannot be used at present" in answer.json()["detail"]
    assert "secret-word" not in answer.text
    health = service.get("/health")
    assert health["queue"].startswith("not known: the catalogue cannot be used")
    assert "mrbench@" not in str(health)
    outage(False)
    assert service.get("/runs")["items"] == []
    assert service.get("/health")["queue"] == "empty"


def test_who_was_signed_in_can_stop_and_do_nothing_else_meanwhile(service, outage, monkeypatch):
    service.post("/users", ADMIN, 201)
    del service.client.headers["Authorization"]
    browser, stranger = Browser(service), Browser(service)
    browser.sign_in(name="anna", password=PASSWORD)
    browser.get("/bench")
    monkeypatch.setattr("bench.service.access.authenticator._KEPT_TIME", 0.0)
    outage(True)
    assert browser.send("POST", "/bench/stop").status_code == 200
    assert service.agent.commands[-1].command == "stop"
    assert browser.send("POST", "/bench/reset").status_code == 503
    stranger.token = "unknown"
    assert stranger.send("POST", "/bench/stop").status_code == 503
    outage(False)
    assert browser.send("POST", "/bench/reset").status_code == 200
    assert stranger.send("POST", "/bench/stop").status_code == 401


def test_the_service_uses_the_database_that_its_folder_keeps(service):
    service.post("/users", ADMIN, 201)
    service.end()
    service.start()
    assert [user["name"] for user in service.get("/users")["items"]] == ["anna"]
    assert not (service.data / CATALOGUE_FILE).exists()

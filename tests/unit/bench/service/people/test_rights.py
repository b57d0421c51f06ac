"""Every operation, for every role, in every state of the bench."""

import re

import pytest

from bench.agent_protocol import AgentStatus
from bench.people import ROLES
from bench.service.access import OPERATION_RIGHTS
from bench.service.application import create_app
from tests.unit.bench.service.people.conftest import PASSWORD

LOWEST = {
    "viewer": """
        DELETE /session, POST /session/codes, GET /tokens, DELETE /tokens/{token_id}, POST /bench/stop,
        POST /bench/abort, POST /benches/{name}/stop, POST /benches/{name}/abort, POST /runs/{run_id}/stop,
        POST /runs/{run_id}/abort, POST /campaigns/{campaign_id}/stop,
        POST /runs/{run_id}/replay, POST /comparisons, POST /methods/dry-run, POST /campaigns/plan
    """,
    "technician": """
        POST /bench/prepare, POST /bench/reset, POST /benches/{name}/prepare,
        POST /benches/{name}/reset, POST /runs, PATCH /runs/{run_id}, POST /runs/{run_id}/pause,
        POST /runs/{run_id}/resume, POST /runs/{run_id}/notes, POST /runs/{run_id}/predict,
        POST /runs/{run_id}/identify, POST /runs/{run_id}/diagnose, POST /runs/{run_id}/integrity, POST /batches,
        POST /jobs/{job_id}/cancel, POST /jobs/{job_id}/retry, POST /logs, POST /specimens,
        PATCH /specimens/{serial}, POST /specimens/{serial}/trend, POST /campaigns,
        PATCH /campaigns/{campaign_id}, POST /campaigns/{campaign_id}/answer,
        POST /campaigns/{campaign_id}/pause, POST /campaigns/{campaign_id}/resume,
        POST /campaigns/test-message, POST /campaigns/{campaign_id}/test-message, PATCH /queue,
        POST /runs/{run_id}/report/copies,
        POST /runs/{run_id}/report/signatures, POST /campaigns/{campaign_id}/report/copies,
        POST /campaigns/{campaign_id}/report/signatures
    """,
    "engineer": """
        DELETE /runs/{run_id}, POST /runs/{run_id}/restore, POST /runs/{run_id}/salvage, POST /methods,
        POST /certificates, PATCH /certificates/{certificate_id}, DELETE /certificates/{certificate_id},
        POST /checks/{channel}/baseline,
        POST /methods/{name}/{version}/approval, DELETE /methods/{name}/{version}/approval
    """,
    "administrator": """
        GET /users, POST /users, DELETE /users/{name}, GET /audit, GET /audit/head, GET /audit/export,
        POST /audit/verify
    """,
}
"""Lowest role for each operation; reading needs a viewer."""
BY_CONTENT = {"POST /session", "PATCH /users/{name}", "POST /tokens"}
"""Operations that depend on their content; `test_users` and `test_sign_in` test them."""
PUBLIC = {"GET /health", "GET /openapi.json"}
STATES = ("idle", "preparing", "running", "stopping", "tripped")


@pytest.fixture(scope="module")
def operations():
    """Return all operations. Their description takes seconds, and is the same for every service."""
    paths = create_app().openapi()["paths"]
    return [
        f"{method.upper()} {path.removeprefix('/api/v1')}" for path, found in paths.items() for method in found
    ]


def find_lowest(operation, state):
    if operation in ("POST /bench/reset", "POST /benches/{name}/reset") and state == "tripped":
        return "engineer"
    for role, text in LOWEST.items():
        if operation in [" ".join(one.split()) for one in text.split(",")]:
            return role
    assert operation.startswith("GET "), f"{operation} is not in the table above"
    return "viewer"


def test_every_operation_that_changes_something_has_its_right(operations):
    described = {re.sub(r":\w+\}", "}", one) for one in OPERATION_RIGHTS}
    changing = {one for one in operations if not one.startswith("GET ")}
    assert changing - described == {"POST /session"}
    assert {one for one in described if not one.startswith("GET ")} <= changing


@pytest.mark.parametrize("state", STATES)
def test_each_role_can_do_what_it_may_and_nothing_else(
    service, people, open_browser, monkeypatch, operations, state
):
    monitor = service.client.app.state.context.benches.get(None).monitor
    monkeypatch.setattr(type(monitor), "latest_status", property(lambda self: AgentStatus(state=state)))
    operations = [one for one in operations if one not in BY_CONTENT | PUBLIC]
    assert len(operations) > 70
    for role in ROLES:
        browser, refused = open_browser(role), set()
        for operation in operations:
            method, path = operation.replace("/benches/{name}", "/benches/bench").split(" ")
            answer = browser.send(method, re.sub(r"\{\w+\}", "1", path), {})
            assert answer.status_code != 401, operation
            if answer.status_code == 403:
                assert answer.json()["type"] == "urn:mrbench:problem:right-missing", answer.text
                refused.add(operation)
            if operation == "DELETE /session":
                browser.sign_in(name=role, password=PASSWORD)
        lowest = {one: ROLES.index(find_lowest(one, state)) for one in operations}
        assert refused == {one for one, index in lowest.items() if index > ROLES.index(role)}


def test_a_reset_needs_the_right_for_a_trip_while_the_state_is_not_known(
    service, people, open_browser, monkeypatch
):
    monitor = service.client.app.state.context.benches.get(None).monitor
    monkeypatch.setattr(type(monitor), "latest_status", property(lambda self: None))
    assert open_browser("technician").send("POST", "/bench/reset").status_code == 403


def test_one_person_has_a_further_right(service, people, bench, open_browser, monkeypatch):
    monitor = service.client.app.state.context.benches.get(None).monitor
    monkeypatch.setattr(type(monitor), "latest_status", property(lambda self: AgentStatus(state="tripped")))
    technician = open_browser("technician")
    refused = technician.send("POST", "/bench/reset")
    assert "lacks the right reset_trip, which the role engineer or administrator has" in refused.json()["detail"]
    bench.send("PATCH", "/users/technician", {"extra_rights": ["reset_trip"]})
    assert technician.send("POST", "/bench/reset").status_code == 200

"""Approved methods, campaigns that require them, and the names of signed-in persons in records."""

import pytest

from bench.agent_protocol import RunCommand

RUN = {"run": {"specimen": "MR-1", "method": "quick"}}
NEXT = {"next_stroke": {"at_most": 2}}
LONG = {"run": {"specimen": "MR-1", "method": "validation"}}


@pytest.fixture
def engineer(people, open_browser):
    return open_browser("engineer")


def find(browser, name):
    return next(one for one in browser.get("/methods")["items"] if one["name"] == name)


def start(browser, steps, **more):
    return browser.send("POST", "/campaigns", {"campaign": {"name": "n", "steps": steps, **more}})


def test_an_engineer_approves_a_method_and_withdraws_it(engineer, open_browser):
    assert find(engineer, "quick")["approved"] is None
    path = f"/methods/quick/{find(engineer, 'quick')['version']}/approval"
    assert open_browser("technician").send("POST", path).status_code == 403
    approved = engineer.send("POST", path).json()
    assert approved["approved_by"] == "The engineer"
    assert find(engineer, "quick") == approved
    assert engineer.send("DELETE", path).json()["approved"] is None


def test_a_changed_method_is_not_approved(engineer):
    engineer.send("POST", "/methods/quick/1/approval")
    changed = {**engineer.get("/methods/quick"), "title": "another content"}
    stored = engineer.send("POST", "/methods", changed)
    assert (stored.status_code, stored.json()["approved"]) == (201, None)


def test_every_version_is_listed_with_its_own_approval(engineer):
    engineer.send("POST", "/methods", {**engineer.get("/methods/quick"), "title": "another content"})
    engineer.send("POST", "/methods/quick/1/approval")
    newest, included = engineer.get("/methods/quick/versions")["items"]
    assert [one["version"] for one in (newest, included)] == [2, 1]
    assert (newest["approved"], included["approved_by"]) == (None, "The engineer")
    assert (newest["source"], included["source"]) == ("stored", "included")
    assert newest["sha256"] != included["sha256"]
    assert engineer.send("GET", "/methods/nothing/versions").status_code == 404


def test_the_audit_trail_has_the_former_approval(engineer, bench):
    for verb in ("POST", "DELETE"):
        engineer.send(verb, "/methods/quick/1/approval")
    withdrawn, approved = bench.get("/audit?action=approval")["items"]
    assert (approved["actor"], approved["old"]["approved_by"]) == ("user:engineer", None)
    assert withdrawn["old"]["approved_by"] == "The engineer"
    assert withdrawn["old"]["sha256"] == engineer.get("/methods/quick/versions")["items"][0]["sha256"]


def test_a_campaign_can_require_approved_methods(engineer):
    refused = start(engineer, [RUN, NEXT], methods="approved")
    assert "proposed strokes" in refused.json()["detail"]
    refused = start(engineer, [RUN], methods="approved")
    assert (refused.status_code, "not approved: quick" in refused.json()["detail"]) == (409, True)
    engineer.send("POST", "/methods/quick/1/approval")
    started = start(engineer, [RUN], methods="approved")
    assert started.status_code == 201
    assert engineer.get(f"/campaigns/{started.json()['id']}")["name"] == "n"


def test_the_approved_version_is_the_one_that_a_campaign_runs(engineer):
    engineer.send("POST", "/methods", {**engineer.get("/methods/quick"), "title": "another content"})
    engineer.send("POST", "/methods/quick/1/approval")
    assert "not approved: quick" in start(engineer, [RUN], methods="approved").json()["detail"]
    named = {"run": {**RUN["run"], "method_version": 1}}
    assert start(engineer, [named], methods="approved").status_code == 201


def test_an_edit_cannot_bring_in_a_method_that_is_not_approved(engineer):
    engineer.send("POST", "/methods/quick/1/approval")
    path = f"/campaigns/{start(engineer, [RUN, RUN], methods='approved').json()['id']}"
    for edit in ({"edit": "add", "steps": [LONG]}, {"edit": "do_now", "step": LONG}):
        answer = engineer.send("PATCH", path, {"edit": edit})
        assert "not approved: validation" in answer.json()["detail"]
    assert engineer.send("PATCH", path, {"edit": {"edit": "add", "steps": [RUN]}}).status_code == 200


def test_the_signed_in_person_is_the_author_of_records(engineer, bench, service):
    started = start(engineer, [{"rest": {"seconds": 100}}]).json()
    for browser, given, expected in (
        (engineer, "Somebody", "The engineer"),
        (bench, "Night script", "Night script"),
    ):
        browser.send("POST", f"/campaigns/{started['id']}/pause", {"who": given})
        events = engineer.get(f"/campaigns/{started['id']}")["events"]
        # The campaign itself may have added an event without a person since.
        assert [event["who"] for event in events if event["who"]][-1] == expected
        browser.send("POST", f"/campaigns/{started['id']}/resume", {"who": given})


@pytest.mark.parametrize(("given", "expected"), [("", "The engineer"), ("A. Technician", "A. Technician")])
def test_the_operator_of_a_run_is_the_signed_in_person_unless_another_is_named(engineer, service, given, expected):
    engineer.send("POST", "/runs", {"method": "quick", "specimen": "MR-1", "operator": given})
    (command,) = [one for one in service.agent.commands if isinstance(one, RunCommand)]
    assert command.operator == expected

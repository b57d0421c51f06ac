"""Old and new value of what requests change, and acts of campaigns."""

import pytest

from bench.agent_protocol import RunCommand
from bench.methods import load_method
from tests.support.audit_trails import find_last_request as find_last
from tests.support.audit_trails import list_all, wait_for

API = "/api/v1"


def test_a_change_of_a_specimen_has_the_old_value_of_what_it_changes(service, client):
    client.post(f"{API}/specimens", json={"serial": "d7", "description": "old", "limits": {"force_n": 900.0}})
    etag = client.get(f"{API}/specimens/d7").headers["etag"]
    change = {"description": "new", "limits": {"force_n": 1200.0}}
    client.patch(f"{API}/specimens/d7", json=change, headers={"If-Match": etag})
    entry = find_last(service)
    assert (entry.action, entry.target, entry.new) == ("PATCH /specimens/{serial}", "d7", change)
    assert entry.old["description"] == "old"
    assert entry.old["limits"]["force_n"] == 900.0
    assert set(entry.old) == set(change)
    client.patch(f"{API}/specimens/d7", json=change, headers={"If-Match": etag})
    assert find_last(service).outcome.startswith("412 specimen d7 was changed meanwhile")


def test_changed_tags_have_the_former_ones(service, client, run):
    for tags in (["a"], ["a", "b"]):
        answer = client.patch(f"{API}/runs/{run}", json={"author": "ada", "tags": tags}, headers={"If-Match": "*"})
        assert answer.status_code == 200
    entry = find_last(service)
    assert (entry.target, entry.old, entry.new["tags"]) == (run, {"tags": ["a"]}, ["a", "b"])


def test_the_trash_has_the_former_place(service, client, run):
    assert client.delete(f"{API}/runs/{run}").status_code == 200
    assert find_last(service).old == {"trashed": None, "log": "one.mcap"}
    assert client.post(f"{API}/runs/{run}/restore").status_code == 200
    assert find_last(service).old["trashed"] is not None


def test_a_new_version_of_a_method_has_the_former_one(service, client):
    document = load_method("quick").model_dump(mode="json", by_alias=True, exclude_defaults=True)
    olds = []
    for title in ("one", "two"):
        assert client.post(f"{API}/methods", json={**document, "title": title}).status_code == 201
        olds.append(find_last(service).old)
    assert olds[0] == {"version": 1, "sha256": load_method("quick").compute_sha256()}
    assert olds[1]["version"] == 2
    assert find_last(service).target == "quick/3"
    client.post(f"{API}/methods", json={**document, "name": "other"})
    assert find_last(service).old is None


def test_a_reset_has_the_trip_that_it_clears(service, client):
    client.post(f"{API}/bench/abort")
    client.post(f"{API}/bench/reset")
    assert find_last(service).old == {"state": "tripped", "trip": "aborted by a person"}


@pytest.fixture
def campaign(service, monkeypatch):
    monkeypatch.setattr("bench.service.campaigns.executor.PERIOD", 0.02)
    steps = [{"run": {"specimen": "MR-1", "method": "quick"}}, {"rest": {"seconds": 500}}]
    return service.post("/campaigns", {"campaign": {"name": "night", "steps": steps}}, 201)


def test_an_edit_of_a_campaign_has_its_former_queue(service, client, campaign):
    first, second = (item["id"] for item in campaign["items"])
    edit = {"who": "ada", "edit": {"edit": "delete", "item": second}}
    assert client.patch(f"{API}/campaigns/{campaign['id']}", json=edit).status_code == 200
    entry = find_last(service)
    assert (entry.target, entry.new) == (campaign["id"], edit)
    assert entry.old["status"] == "running"
    assert [one.split()[0] for one in entry.old["queue"]] == [first, second]


def test_a_run_that_a_campaign_starts_is_an_act_of_the_campaign(service, campaign):
    wait_for(lambda: any(isinstance(one, RunCommand) for one in service.agent.commands))
    path = service.data / "audit.jsonl"
    found = wait_for(lambda: [one for one in list_all(path) if one.action == "run by the service"])
    assert [one.actor for one in found] == [f"campaign:{campaign['id']}"]
    assert (found[0].new["specimen"], found[0].new["method"]["name"], found[0].outcome) == ("MR-1", "quick", "ok")
    (lease,) = [one for one in list_all(path) if one.action == "lease by the service"]
    assert (lease.actor, lease.outcome) == (found[0].actor, "ok")

"""Routes of the audit trail: pages, conditions, head, verification, export."""

import csv

import pytest

from tests.support.audit_trails import list_all

API = "/api/v1"


@pytest.fixture
def entries(service, client):
    for serial in ("d1", "d2", "d3"):
        client.post(f"{API}/specimens", json={"serial": serial, "description": f"damper of {serial}"})
        etag = client.get(f"{API}/specimens/{serial}").headers["etag"]
        client.patch(f"{API}/specimens/{serial}", json={"damper_kind": "RD"}, headers={"If-Match": etag})
    return list_all(service.data / "audit.jsonl")


def test_pages_follow_each_other_from_the_newest_to_the_oldest(service, entries):
    found, before = [], ""
    while before is not None:
        page = service.get(f"/audit?limit=3{before}")
        found += page["items"]
        before = None if page["next"] is None else f"&before={page['next']}"
    assert [one["seq"] for one in found] == [one.seq for one in entries][::-1]


@pytest.mark.parametrize(
    ("query", "count"),
    [
        ("actor=bench", 6),
        ("actor=ben", 0),
        ("action=patch", 3),
        ("action=PATCH%20/specimens", 3),
        ("target=d2", 1),
        ("target=d", 0),
        ("text=damper%20of%20D2", 1),
        ("text=nowhere", 0),
        ("from=2020-01-01T00:00:00Z", 8),
        ("to=2020-01-01T00:00:00Z", 0),
        ("from=2020-01-01T00:00:00%2B05:00&actor=bench&action=post", 3),
    ],
)
def test_conditions_select_entries(service, entries, query, count):
    assert len(service.get(f"/audit?{query}")["items"]) == count


def test_seconds_since_1970_are_no_time_of_the_description(client):
    answer = client.get(f"{API}/audit?from=178560719985")
    assert answer.status_code == 422
    assert "query.from: a number is not a time; use ISO 8601 with a zone" in answer.json()["detail"]


def test_head_and_verification_agree(service, client, entries):
    head = service.get("/audit/head")
    assert head["head"] == f"{entries[-1].seq}:{entries[-1].sha256}"
    answer = service.post("/audit/verify", {"head": head["head"]})
    assert (answer["intact"], answer["fault"], answer["entries"]) == (True, "", head["seq"])
    wrong = service.post("/audit/verify", {"head": f"99:{'0' * 64}"})
    assert not wrong["intact"]
    assert "the end is missing" in wrong["fault"]
    assert client.post(f"{API}/audit/verify", json={"head": "x"}).status_code == 409


def test_an_alteration_while_the_service_runs_is_found(service, entries):
    path = service.data / "audit.jsonl"
    path.write_bytes(path.read_bytes().replace(b"damper of d2", b"damper of d9"))
    answer = service.post("/audit/verify", {})
    assert not answer["intact"]
    assert answer["fault"].startswith("line 5: its content does not have its hash")


def test_exports_contain_every_entry_and_the_head(service, client, entries):
    exported = service.get("/audit/export")
    assert exported["head"] == f"{entries[-1].seq}:{entries[-1].sha256}"
    assert [one["sha256"] for one in exported["entries"]] == [one.sha256 for one in entries]
    answer = client.get(f"{API}/audit/export?format=csv")
    assert answer.headers["content-disposition"] == f'attachment; filename="audit-{entries[-1].seq}.csv"'
    rows = list(csv.DictReader(answer.text.splitlines()))
    assert [row["sha256"] for row in rows[:-1]] == [one.sha256 for one in entries]

"""Specimens by the REST interface: registered at their first use, described by people."""

import hashlib

import pytest

from bench.catalogue import RunRow
from tests.support.service_logs import STARTED


def add_run(service, number, specimen):
    (service.data / f"{number}.mcap").write_bytes(b"a log")
    values = {"method": "quick", "specimen": specimen, "started": STARTED, "state": "ended"}
    values |= {"log": f"{number}.mcap", "log_sha256": hashlib.sha256(b"a log").hexdigest()}
    # An import: a run of the bench would be identified by the next scan.
    row = RunRow(id=f"run-{number}", outcome="clean", reason="", source="import", **values)
    service.client.app.state.context.catalogue.add(row)


def patch(service, serial, change, tag, status=200):
    headers = {} if tag is None else {"If-Match": tag}
    answer = service.client.patch(f"/api/v1/specimens/{serial}", json=change, headers=headers)
    assert answer.status_code == status, answer.text
    return answer


def test_serial_numbers_of_runs_are_listed_without_a_description(service):
    for number, serial in enumerate(["MR-2", "MR-1", "MR-2", ""]):
        add_run(service, number, serial)
    found = service.get("/specimens")["items"]
    facts = [(one["serial"], one["runs"], one["registered"]) for one in found]
    assert facts == [("MR-1", 1, None), ("MR-2", 2, None)]
    assert service.get("/specimens/MR-2")["last_run"].startswith("2026")


def test_a_specimen_is_registered_with_kind_drive_and_limits(service):
    body = {"serial": "MR/7 b", "damper_kind": "RD-8040", "drive_kind": "coil_a", "limits": {"stroke_m": 0.02}}
    made = service.post("/specimens", body, 201)
    assert (made["damper_kind"], made["drive_kind"], made["limits"]["stroke_m"]) == ("RD-8040", "coil_a", 0.02)
    assert service.get("/specimens/MR/7 b") == made
    again = service.post("/specimens", body, 409)
    assert again["type"] == "urn:mrbench:problem:specimen-registered"


def test_pages_and_search_follow_the_serial_numbers(service):
    for serial in ("a1", "a2", "b1"):
        service.post("/specimens", {"serial": serial, "description": "gas spring" if serial == "b1" else ""}, 201)
    first = service.get("/specimens?limit=2")
    assert [one["serial"] for one in first["items"]] == ["a1", "a2"]
    assert [one["serial"] for one in service.get(f"/specimens?before={first['next']}")["items"]] == ["b1"]
    assert [one["serial"] for one in service.get("/specimens?text=GAS")["items"]] == ["b1"]


def test_a_change_needs_the_tag_of_what_was_read(service):
    add_run(service, 1, "MR-1")
    tag = service.client.get("/api/v1/specimens/MR-1").headers["ETag"]
    changed = patch(service, "MR-1", {"description": "first"}, tag)
    assert changed.json()["description"] == "first"
    assert patch(service, "MR-1", {"description": "lost"}, tag, 412).json()["detail"].startswith("specimen MR-1")
    kept = patch(service, "MR-1", {"damper_kind": "long"}, changed.headers["ETag"]).json()
    assert (kept["description"], kept["damper_kind"]) == ("first", "long")
    assert "If-Match" in patch(service, "MR-1", {"description": "x"}, None, 428).json()["detail"]


@pytest.mark.parametrize("serial", ["", " ", "a\u0000b", "a\nb", " a", "x" * 201])
def test_an_unusable_serial_number_starts_no_run_and_registers_nothing(service, serial):
    for path, body in (("/runs", {"method": "quick", "specimen": serial}), ("/specimens", {"serial": serial})):
        assert "serial number" in service.post(path, body, 422)["detail"]
    assert service.agent.commands == []
    assert service.get("/specimens")["items"] == []


def test_without_a_serial_number_the_mounted_damper_is_used_if_the_bench_names_one(service):
    assert service.post("/runs", {"method": "quick"}, 201)["state"] == "running"
    service.agent.description = service.agent.description.model_copy(update={"specimen": ""})
    assert "bench.toml names none" in service.post("/runs", {"method": "quick"}, 422)["detail"]


def test_a_specimen_that_nobody_has_named_is_not_found(service):
    assert service.client.get("/api/v1/specimens/none").status_code == 404
    assert service.client.get("/api/v1/specimens/none/trend").status_code == 404

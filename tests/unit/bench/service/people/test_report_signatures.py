"""Signatures of reports: who signs which bytes, how the audit trail has it, and what is refused."""

import hashlib
import os
import time
from itertools import count
from pathlib import Path

import pytest

from bench.audit import find_signatures, verify_chain
from bench.catalogue import UserRow
from bench.people import new_secret
from bench.service.access import compute_csrf
from tests.support.service_logs import write_complete_log
from tests.unit.bench.service.people.conftest import PASSWORD

REPORT = "/runs/run-1/report"


@pytest.fixture
def run(service, people, monkeypatch):
    """Provide a run whose report differs each time that it is made, as a real one does by its time."""
    number = count(1)

    def make(arguments, error):
        Path(arguments[-1]).write_text(f"<!doctype html><p>report {next(number)}")

    for module in ("exchange", "campaigns"):
        monkeypatch.setattr(f"bench.service.routes.{module}.reports.run_command", make)
    write_complete_log(service.data / "one.mcap", "run-1")
    service.scan()
    return "run-1"


@pytest.fixture
def engineer(run, open_browser):
    return open_browser("engineer")


def keep(browser, path=REPORT):
    answer = browser.send("POST", f"{path}/copies", {})
    assert answer.status_code == 201, answer.text
    return answer.json()


def sign(browser, sha256, password=PASSWORD, meaning="reviewed", path=REPORT):
    body = {"sha256": sha256, "meaning": meaning, "password": password}
    return browser.send("POST", f"{path}/signatures", body)


def list_signed(browser, path=REPORT):
    return browser.get(f"{path}/signatures")["items"]


def test_a_person_signs_the_bytes_that_were_read_and_the_trail_has_their_hash(service, bench, engineer):
    kept = keep(engineer)
    read = engineer.send("GET", kept["path"].removeprefix("/api/v1"))
    assert hashlib.sha256(read.content).hexdigest() == kept["sha256"]
    signed = sign(engineer, kept["sha256"])
    assert signed.status_code == 201, signed.text
    (shown,) = list_signed(engineer)
    assert shown == signed.json()
    assert (shown["full_name"], shown["meaning"], shown["file"]) == ("The engineer", "reviewed", "intact")
    assert not shown["newer_results"]
    assert engineer.send("GET", shown["path"].removeprefix("/api/v1")).content == read.content
    (entry,) = find_signatures(service.data / "audit.jsonl", kept["sha256"])
    assert (entry.seq, entry.actor, entry.target) == (shown["audit_seq"], "user:engineer", "run-1")
    assert entry.new["meaning"] == "reviewed"
    assert entry.new["full_name"] == "The engineer"
    request = bench.get("/audit?action=signatures")["items"][0]
    assert (request["request"], request["outcome"]) == (entry.request, "201")
    assert not verify_chain(service.data / "audit.jsonl").fault
    assert PASSWORD not in (service.data / "audit.jsonl").read_text()


def test_a_report_that_is_made_again_is_another_file_without_a_signature(service, engineer):
    first, second = keep(engineer), keep(engineer)
    assert first["sha256"] != second["sha256"]
    sign(engineer, first["sha256"])
    assert find_signatures(service.data / "audit.jsonl", second["sha256"]) == []


def test_one_person_signs_a_file_once_for_each_meaning_and_another_person_signs_it_too(engineer, open_browser):
    sha256 = keep(engineer)["sha256"]
    assert sign(engineer, sha256).status_code == 201
    again = sign(engineer, sha256)
    assert (again.status_code, again.json()["type"]) == (409, "urn:mrbench:problem:signed-already")
    assert sign(engineer, sha256, meaning="author").status_code == 201
    assert sign(open_browser("administrator"), sha256, meaning="approved").status_code == 201
    found = [(one["user"], one["meaning"]) for one in list_signed(engineer)]
    assert found == [("engineer", "reviewed"), ("engineer", "author"), ("administrator", "approved")]


def test_wrong_passwords_sign_nothing_and_lock_the_person_out_as_at_a_sign_in(
    service, bench, engineer, open_browser
):
    sha256 = keep(engineer)["sha256"]
    for _ in range(5):
        wrong = sign(engineer, sha256, "not the password")
        assert (wrong.status_code, wrong.json()["type"]) == (403, "urn:mrbench:problem:wrong-password")
    locked = sign(engineer, sha256)
    assert (locked.status_code, locked.json()["type"]) == (429, "urn:mrbench:problem:too-many-attempts")
    assert 0 < int(locked.headers["retry-after"]) <= 30
    open_browser().sign_in(status=429, name="engineer", password=PASSWORD)
    assert list_signed(engineer) == []
    assert find_signatures(service.data / "audit.jsonl", sha256) == []
    assert len(bench.get("/audit?action=signatures&actor=user:engineer")["items"]) == 6


def test_programs_and_users_of_a_provider_cannot_sign(service, bench, engineer, open_browser):
    sha256 = keep(engineer)["sha256"]
    refused = sign(bench, sha256)
    assert (refused.status_code, refused.json()["type"]) == (403, "urn:mrbench:problem:person-needed")
    row = UserRow(name="external", role="engineer", extra_rights=[], external_id="issuer subject")
    context = service.client.app.state.context
    context.catalogue.users.add(row)
    browser = open_browser("technician")
    context.catalogue.sessions.end_all("user", "technician")
    browser.cookie, browser.csrf = begin_session(context, "external")
    refused = sign(browser, sha256)
    assert (refused.status_code, refused.json()["type"]) == (403, "urn:mrbench:problem:external-user")
    assert list_signed(engineer) == []


def begin_session(context, name):
    secret, sha256 = new_secret()
    context.catalogue.sessions.add(sha256, "user", name)
    return secret, compute_csrf(secret)


def test_a_viewer_reads_signatures_but_signs_only_with_the_further_right(bench, engineer, open_browser):
    sha256, viewer = keep(engineer)["sha256"], open_browser("viewer")
    assert sign(viewer, sha256).json()["type"] == "urn:mrbench:problem:right-missing"
    assert list_signed(viewer) == []
    bench.send("PATCH", "/users/viewer", {"extra_rights": ["sign_reports"]})
    assert sign(viewer, sha256).status_code == 201


def test_an_altered_or_missing_file_is_not_signed_and_is_named_where_it_is_signed(service, engineer):
    sha256 = keep(engineer)["sha256"]
    sign(engineer, sha256)
    (path,) = (service.data / "reports").rglob(f"{sha256}.html")
    path.write_text("<!doctype html><p>another result")
    assert list_signed(engineer)[0]["file"] == "changed"
    refused = sign(engineer, sha256, meaning="approved")
    assert (refused.status_code, refused.json()["type"]) == (409, "urn:mrbench:problem:report-altered")
    path.unlink()
    assert list_signed(engineer)[0]["file"] == "missing"
    assert sign(engineer, sha256, meaning="approved").status_code == 404


@pytest.mark.parametrize("path", ["copies/..%2F..%2Fcatalogue", "copies/*", f"copies/{'0' * 64}"])
def test_only_kept_files_are_returned(engineer, path):
    keep(engineer)
    assert engineer.send("GET", f"{REPORT}/{path}").status_code == 404


def test_files_without_a_signature_are_deleted_after_a_day(service, engineer):
    signed, unsigned = keep(engineer)["sha256"], keep(engineer)["sha256"]
    sign(engineer, signed)
    for path in (service.data / "reports").rglob("*.html"):
        os.utime(path, (time.time() - 90_000,) * 2)
    newest = keep(engineer)["sha256"]
    found = {path.stem for path in (service.data / "reports").rglob("*.html")}
    assert found == {signed, newest}
    assert unsigned not in found


def test_results_that_are_newer_than_the_signed_report_are_named(service, engineer):
    sha256 = keep(engineer)["sha256"]
    sign(engineer, sha256)
    job = engineer.send("POST", "/runs/run-1/identify", {}).json()
    summary = {"rmse_n": 1.0, "noise_floor_n": 0.9, "result": "converged"}
    service.client.headers["Authorization"] = f"Bearer {service.token}"
    service.complete(job, summary, {"fit.json": "{}"})
    service.wait_for("/runs/run-1/report/signatures", lambda found: found["items"][0]["newer_results"])


def test_the_report_of_a_campaign_is_signed_in_the_same_way(service, engineer):
    started = engineer.send(
        "POST", "/campaigns", {"campaign": {"name": "night", "steps": [{"rest": {"seconds": 900}}]}}
    )
    path = f"/campaigns/{started.json()['id']}/report"
    sha256 = keep(engineer, path)["sha256"]
    assert sign(engineer, sha256, meaning="approved", path=path).status_code == 201
    (shown,) = list_signed(engineer, path)
    assert (shown["meaning"], shown["file"]) == ("approved", "intact")
    (entry,) = find_signatures(service.data / "audit.jsonl", sha256)
    assert (entry.new["report"], entry.target) == ("campaign", started.json()["id"])
    assert sign(engineer, sha256).status_code == 404, "the file belongs to the campaign, not to the run"

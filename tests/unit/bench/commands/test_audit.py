"""`mrbench audit`: verification with its exit status, head, and export."""

import csv
import json
from importlib.metadata import EntryPoint

import pytest
from typer.testing import CliRunner

from bench.audit import Act, AuditChain, Source, find_agent_trail, find_signatures, make_signature, verify_chain
from bench.catalogue import Catalogue, back_up, compute_sha256, make_sqlite_url, open_database
from bench.cli import _make_application
from bench.errors import AuditError
from tests.support.audit_trails import list_all, make_act, write_trail
from tests.support.fake_rig import BENCH_TOML

APPLICATION = _make_application([EntryPoint("audit", "bench.commands.audit:audit", "mrbench.commands")])


def call(*arguments):
    return CliRunner().invoke(APPLICATION, ["audit", *map(str, arguments)])


@pytest.fixture
def data(tmp_path):
    folder = tmp_path / "runs"
    folder.mkdir()
    write_trail(folder / "audit.jsonl", 5)
    return folder


def test_an_untouched_trail_is_verified(data):
    answer = call("verify", "--data", data)
    assert answer.exit_code == 0, answer.output
    assert "6 entries, head 6:" in answer.output
    assert "nothing was altered; a missing end is found only with --head" in answer.output


def test_an_alteration_ends_with_an_error_that_names_it(data):
    path = data / "audit.jsonl"
    path.write_bytes(path.read_bytes().replace(b"user:u1", b"user:u7", 1))
    answer = call("verify", "--data", data)
    assert isinstance(answer.exception, AuditError)
    assert answer.exception.exit_code == 1
    assert "the audit trail was altered: line 3: its content does not have its hash" in str(answer.exception)


@pytest.mark.parametrize("as_file", [True, False])
def test_a_cut_end_is_found_by_a_head_that_was_kept(data, tmp_path, as_file):
    head = call("head", "--data", data).output
    kept = tmp_path / "head"
    kept.write_text(head)
    given = kept if as_file else head.strip()
    assert "nothing was altered\n" in call("verify", "--data", data, "--head", given).output
    path = data / "audit.jsonl"
    path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:-2]))
    assert call("verify", "--data", data).exit_code == 0
    answer = call("verify", "--data", data, "--head", given)
    assert "the end is missing: 2 entries, from 5 to 6" in str(answer.exception)


def test_an_export_as_json_contains_the_entries_and_serves_as_a_head(data, tmp_path):
    out = tmp_path / "audit.json"
    assert call("export", "--data", data, "--out", out).exit_code == 0
    exported = json.loads(out.read_text())
    assert exported["head"] == call("head", "--data", data).output.strip()
    assert [one["seq"] for one in exported["entries"]] == [1, 2, 3, 4, 5, 6]
    assert call("verify", "--data", data, "--head", out).exit_code == 0
    assert json.loads(call("export", "--data", data, "--out", "-").output) == exported


def test_an_export_as_csv_is_a_table_without_formulas(data, tmp_path):
    AuditChain(data / "audit.jsonl").append(make_act(1, target="=cmd()", old=None))
    out = tmp_path / "audit.csv"
    call("export", "--data", data, "--out", out)
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert len(rows) == 8
    assert (rows[6]["target"], rows[6]["old"], json.loads(rows[6]["new"])["n"]) == ("'=cmd()", "", 2)
    assert rows[7]["utc"] == "head"
    assert call("verify", "--data", data, "--head", out).exit_code == 0


def test_options_that_do_not_belong_to_an_action_are_refused(data):
    for arguments in (
        ("export",),
        ("head", "--head", "x"),
        ("verify", "--out", "x"),
        ("export", "--out", "a.xlsx"),
    ):
        assert call(*arguments, "--data", data).exit_code == 2


def test_the_trail_of_the_agent_is_verified_by_its_configuration(data, tmp_path):
    config = tmp_path / "bench.toml"
    config.write_text(BENCH_TOML)
    agent = find_agent_trail(config)
    assert agent == tmp_path / "runs" / "bench.audit.jsonl"
    AuditChain(agent).append(Act(actor="local:ada", action="stop"))
    answer = call("verify", "--data", data, "--config", config)
    assert answer.exit_code == 0, answer.output
    assert f"{agent}: 2 entries" in answer.output
    agent.write_bytes(agent.read_bytes().replace(b"ada", b"bob"))
    answer = call("verify", "--data", data, "--config", config)
    assert f"{agent}: the audit trail was altered" in str(answer.exception)


def test_the_signatures_of_a_report_are_told_and_an_unsigned_file_is_an_error(data, tmp_path):
    report = tmp_path / "report.html"
    report.write_text("<!doctype html>")
    content = {"sha256": compute_sha256(report), "full_name": "Marie Curie", "role": "engineer", "report": "run"}
    chain = AuditChain(data / "audit.jsonl")
    for user, meaning in (("mcurie", "author"), ("lmeitner", "approved")):
        chain.append(make_signature(f"user:{user}", "10.0.0.7", "1", "run-1", {**content, "meaning": meaning}))
    answer = call("verify", "--data", data, "--report", report)
    assert answer.exit_code == 0, answer.output
    first, second, file = answer.output.splitlines()[-3:]
    assert first.startswith("signed as author by Marie Curie (user:mcurie, engineer) at ")
    assert second.endswith(", entry 8")
    assert file == f"{report}: SHA-256 {content['sha256']}, report on run run-1"
    report.write_text("<!doctype html> ")
    answer = call("verify", "--data", data, "--report", report)
    assert isinstance(answer.exception, AuditError)
    assert "nobody has signed this file" in str(answer.exception)


def test_an_imported_entry_is_no_signature(data, tmp_path):
    report = tmp_path / "report.html"
    report.write_text("<!doctype html>")
    act = make_signature("user:mcurie", "", "", "run-1", {"sha256": compute_sha256(report)})
    forged = act.model_copy(update={"source": Source(chain="c", seq=1, prev="0" * 64, sha256="1" * 64)})
    AuditChain(data / "audit.jsonl").append(forged)
    assert find_signatures(data / "audit.jsonl", compute_sha256(report)) == []


def test_a_backup_contains_the_trail(data, tmp_path):
    Catalogue(open_database(make_sqlite_url(data / "catalogue.db")), data).close()
    back_up(data, tmp_path / "backup")
    copied = tmp_path / "backup" / "audit.jsonl"
    assert list_all(copied) == list_all(data / "audit.jsonl")
    assert not verify_chain(copied).fault

"""`mrbench transfer`: what it prints, and that later commands use the new database."""

import json
from importlib.metadata import EntryPoint

import pytest
from typer.testing import CliRunner

from bench.catalogue import find_catalogue, make_sqlite_url, open_catalogue
from bench.cli import _make_application
from tests.support.audit_trails import list_all
from tests.support.full_catalogues import fill_for_search, make_file


@pytest.fixture
def data(tmp_path):
    """Provide a data folder with three runs."""
    folder = tmp_path / "runs"
    fill_for_search(make_file(folder), folder)
    return folder


@pytest.fixture
def call():
    application = _make_application([EntryPoint("transfer", "bench.commands.backup:transfer", "mrbench.commands")])
    return lambda *words, **more: CliRunner().invoke(application, ["transfer", *words], **more)


def test_the_command_names_rows_and_both_databases_without_a_password(data, postgres_server, call):
    url = postgres_server.make_catalogue()
    answer = call("--data", str(data), env={"MRBENCH_CATALOGUE": url})
    assert answer.exit_code == 0, answer.output
    lines = [" ".join(line.split()) for line in answer.stdout.splitlines()]
    assert {"3 rows runs", "12 rows jobs", "1 rows notes"} <= set(lines)
    assert any(line.startswith("0 rows ") and " users" in line for line in lines)
    assert lines[-3].startswith("16 rows in all, each compared with its copy")
    assert lines[-2].startswith("used from now on: postgresql://mrbench:***@/")
    assert lines[-1] == f"no longer used, and unchanged: {make_sqlite_url(data / 'catalogue.db')}"
    assert find_catalogue(data) == url
    with open_catalogue(data) as catalogue:
        assert [run.id for run in catalogue.list_runs(10)] == ["run-3", "run-2", "run-1"]
    entry = list_all(data / "audit.jsonl")[-1]
    assert (entry.action, entry.new["rows"]) == ("transfer", 16)
    assert "secret-word" not in answer.output + str(entry)


def test_the_result_as_json_has_the_rows_of_each_table(data, postgres_server, call):
    answer = call("--data", str(data), "--catalogue", postgres_server.make_catalogue(), "--out", "-")
    result = json.loads(answer.stdout)
    assert (result["rows"], result["replaced_texts"], result["tables"]["jobs"]) == (16, 0, 12)
    assert result["source"] == make_sqlite_url(data / "catalogue.db")
    assert result["duration_s"] > 0


def test_misuse_changes_nothing(data, call):
    assert call("--data", str(data)).exit_code == 2
    assert call("--data", str(data), "--catalogue", "sqlite", "--out", "result.json").exit_code == 2
    assert [path.name for path in data.iterdir()] == ["catalogue.db"]

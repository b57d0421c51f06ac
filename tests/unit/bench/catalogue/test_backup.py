"""Backup of a data folder in use, and its restoration."""

import sqlite3
from importlib.metadata import EntryPoint

import pytest
from typer.testing import CliRunner

from bench.catalogue import (
    Catalogue,
    back_up,
    keep_address,
    make_sqlite_url,
    open_catalogue,
    open_database,
    restore_backup,
    scan_logs,
)
from bench.catalogue.errors import CatalogueError
from bench.cli import _make_application
from tests.support.service_logs import write_complete_log, write_truncated_log


def open_file(folder):
    return Catalogue(open_database(make_sqlite_url(folder / "catalogue.db")), folder)


@pytest.fixture
def data(tmp_path):
    """Provide the data folder of a service that is in the middle of its work."""
    folder = tmp_path / "runs"
    (folder / "one.fit-1").mkdir(parents=True)
    (folder / ".one.fit-2.half").mkdir()
    write_complete_log(folder / "one.mcap", "run-1")
    for name in (
        "one.fit-1/fit.json",
        ".one.fit-2.half/fit.json",
        "token",
        "token.sha256",
        "service.lock",
        "agent.log",
    ):
        (folder / name).write_text(name)
    catalogue = open_file(folder)
    scan_logs(catalogue, lambda path: False)
    write_truncated_log(folder / "two.mcap", "run-2")
    yield folder
    catalogue.close()


def list_files(folder):
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def test_a_backup_in_use_restores_runs_logs_and_results(data, tmp_path):
    backup, restored = tmp_path / "backup", tmp_path / "restored"
    with sqlite3.connect(data / "catalogue.db") as writer:
        writer.execute("UPDATE runs SET reason = 'not committed'")
        copied = back_up(data, backup)
        writer.rollback()
    assert copied[:2] == (1, 4)
    assert restore_backup(backup, restored) == copied
    names = ["catalogue.db", "one.fit-1/fit.json", "one.mcap", "token.sha256", "two.mcap"]
    assert list_files(restored) == names
    assert (restored / "one.mcap").read_bytes() == (data / "one.mcap").read_bytes()
    catalogue = open_file(restored)
    scan_logs(catalogue, lambda path: False)
    runs = {run.id: (run.state, run.reason[:3]) for run in catalogue.list_runs(10)}
    catalogue.close()
    assert runs == {"run-1": ("ended", ""), "run-2": ("truncated", "the")}


def test_nothing_is_overwritten(data, tmp_path):
    used = tmp_path / "used"
    used.mkdir()
    (used / "file").write_text("kept")
    for copy in (back_up, restore_backup):
        with pytest.raises(CatalogueError, match="it exists; nothing was changed"):
            copy(data, used)
    assert list_files(used) == ["file"]


def test_a_folder_without_a_catalogue_and_a_damaged_one_are_refused_and_nothing_stays(data, tmp_path):
    with pytest.raises(CatalogueError, match="there is no catalogue"):
        back_up(tmp_path, tmp_path / "backup")
    back_up(data, tmp_path / "backup")
    (tmp_path / "backup" / "catalogue.db").write_bytes(b"SQLite format 3\0" + bytes(5000))
    with pytest.raises(CatalogueError, match="nothing was kept"):
        restore_backup(tmp_path / "backup", tmp_path / "restored")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["backup", "runs"]


def test_the_commands_name_what_they_copied(data, tmp_path):
    entries = [
        EntryPoint(name, f"bench.commands.backup:{name}", "mrbench.commands") for name in ("backup", "restore")
    ]
    application = _make_application(entries)
    backup, restored = str(tmp_path / "backup"), tmp_path / "restored"
    restored.mkdir()
    for arguments in (["backup", str(data), "--out", backup], ["restore", backup, "--data", str(restored)]):
        answer = CliRunner().invoke(application, arguments)
        assert answer.exit_code == 0, answer.output
        assert ": 1 runs, 4 files, 0.1 MB" in answer.output
    assert (restored / "one.mcap").is_file()


@pytest.fixture
def server_data(tmp_path, postgres_server):
    """Provide a data folder with a run whose catalogue is in PostgreSQL."""
    folder = tmp_path / "runs"
    folder.mkdir()
    keep_address(folder, postgres_server.make_catalogue())
    write_complete_log(folder / "one.mcap", "run-1")
    with open_catalogue(folder) as catalogue:
        scan_logs(catalogue, lambda path: False)
    return folder


def test_a_catalogue_in_postgresql_is_dumped_and_restored_into_an_empty_database(
    server_data, tmp_path, postgres_server
):
    backup, restored = tmp_path / "backup", tmp_path / "restored"
    copied = back_up(server_data, backup)
    assert list_files(backup) == ["catalogue.dump", "one.mcap"]
    assert b"secret-word" not in (backup / "catalogue.dump").read_bytes()
    url = postgres_server.make_database()
    assert restore_backup(backup, restored, url) == copied
    assert list_files(restored) == ["catalogue.url", "one.mcap"]
    with open_catalogue(restored) as catalogue:
        assert [run.id for run in catalogue.list_runs(10)] == ["run-1"]
        assert scan_logs(catalogue, lambda path: False) == []
    with pytest.raises(CatalogueError, match=r"the database has \d+ tables; nothing was changed"):
        restore_backup(backup, tmp_path / "again", url)
    assert not (tmp_path / "again").exists()


def test_a_backup_is_restored_into_its_own_kind_of_database_only(server_data, tmp_path, postgres_server):
    back_up(server_data, tmp_path / "server")
    with pytest.raises(CatalogueError, match="one of PostgreSQL; give --catalogue"):
        restore_backup(tmp_path / "server", tmp_path / "restored")
    with open_catalogue(tmp_path / "file", is_created=True):
        pass
    back_up(tmp_path / "file", tmp_path / "copy")
    with pytest.raises(CatalogueError, match="one of SQLite; leave --catalogue out"):
        restore_backup(tmp_path / "copy", tmp_path / "restored", postgres_server.make_database())
    assert not (tmp_path / "restored").exists()


def test_a_missing_program_of_postgresql_is_named_and_nothing_stays(server_data, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(CatalogueError, match="pg_dump is not installed; install the package postgresql-client"):
        back_up(server_data, tmp_path / "backup")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["runs"]

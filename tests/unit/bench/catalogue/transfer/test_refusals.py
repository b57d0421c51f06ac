"""Transfers that are refused or fail: the data folder keeps its database, and the target stays as it was."""

import sqlite3

import pytest
from alembic import command
from alembic.config import Config
from sqlalchemy import create_engine, inspect, make_url

from bench.catalogue import (
    CatalogueError,
    CatalogueUnavailableError,
    find_catalogue,
    make_sqlite_url,
    open_database,
    transfer_catalogue,
)
from bench.catalogue.database import parse_address
from bench.catalogue.transfer import copying
from bench.folder_lock import hold_lock
from tests.support.full_catalogues import fill_all_tables, fill_for_search, read_all

OLDER = "0010"
"""Version of the tables before specimens, people and certificates."""


def list_tables(url):
    engine = create_engine(parse_address(url))
    names = inspect(engine).get_table_names()
    engine.dispose()
    return names


def migrate_to(url, version):
    config = Config()
    config.set_main_option("script_location", "bench.catalogue:migrations")
    engine = create_engine(parse_address(url))
    with engine.begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, version)
    engine.dispose()


def assert_nothing_changed(data, file_url, before=None):
    assert find_catalogue(data) == file_url
    assert sorted(path.name for path in data.iterdir()) == ["catalogue.db", "service.lock"]
    assert before is None or read_all(file_url) == before


def test_a_folder_in_use_is_refused(data, file_url, server_url, transfer):
    with hold_lock(data), pytest.raises(CatalogueError, match="a service uses the data folder"):
        transfer(data, server_url)
    assert_nothing_changed(data, file_url)


def test_a_file_that_another_process_has_open_is_refused(data, file_url, server_url, transfer):
    engine = open_database(file_url)
    with (
        engine.connect(),
        pytest.raises(CatalogueError, match=r"another process uses the catalogue.*database is locked"),
    ):
        transfer(data, server_url)
    engine.dispose()
    transfer(data, server_url)


def test_a_server_that_another_process_uses_is_refused(server_data, server_url, transfer, monkeypatch):
    monkeypatch.setattr("bench.catalogue.transfer.source._PATIENCE", 0.0)
    engine = open_database(server_url)
    with pytest.raises(CatalogueError, match=r"another process uses the catalogue.*1 connections, allowed 0"):
        transfer(server_data, "sqlite")
    engine.dispose()
    assert find_catalogue(server_data) == server_url


def test_a_target_with_rows_is_refused(data, file_url, server_url, transfer):
    fill_all_tables(server_url)
    before = read_all(server_url)
    with pytest.raises(CatalogueError, match=r"table \w+ of the database has 2 rows, allowed 0") as refused:
        transfer(data, server_url)
    assert "secret-word" not in str(refused.value)
    assert read_all(server_url) == before
    assert_nothing_changed(data, file_url)


def test_a_target_of_another_program_is_refused(data, file_url, transfer, postgres_server):
    url = postgres_server.make_database()
    postgres_server.execute("CREATE TABLE parts (id integer)", url)
    with pytest.raises(CatalogueError, match="has 1 tables of another program"):
        transfer(data, url)
    assert list_tables(url) == ["parts"]
    assert_nothing_changed(data, file_url)


def test_a_target_of_a_later_version_is_refused(data, file_url, server_url, transfer, postgres_server):
    (version,) = postgres_server.execute("SELECT version_num FROM alembic_version", server_url)
    postgres_server.execute("UPDATE alembic_version SET version_num = '9999'", server_url)
    try:
        with pytest.raises(CatalogueError, match="written by a later version"):
            transfer(data, server_url)
    finally:
        postgres_server.execute(f"UPDATE alembic_version SET version_num = '{version[0]}'", server_url)
    assert_nothing_changed(data, file_url)


def test_source_and_target_of_an_earlier_version_are_migrated(tmp_path, transfer, postgres_server):
    (tmp_path / "old").mkdir()
    source = make_sqlite_url(tmp_path / "old" / "catalogue.db")
    migrate_to(source, OLDER)
    with sqlite3.connect(tmp_path / "old" / "catalogue.db") as connection:
        connection.execute(
            "INSERT INTO runs (id, method, specimen, operator, source, started, state, reason, log) "
            "VALUES ('r', 'quick', 'MR-1', '', 'run', '2026-03-01 10:00:00', 'ended', '', 'r.mcap')"
        )
    connection.close()
    target = postgres_server.make_database()
    migrate_to(target, OLDER)
    assert transfer(tmp_path / "old", target).tables["runs"] == 1
    assert read_all(target) == read_all(source)


def test_the_source_is_no_target(data, server_data, server_url, transfer):
    with pytest.raises(CatalogueError, match="is in SQLite already"):
        transfer(data, "sqlite")
    with pytest.raises(CatalogueError, match="is the source of this transfer"):
        transfer(
            server_data, make_url(server_url).update_query_dict({"connect_timeout": "9"}).render_as_string(False)
        )


def test_an_address_that_is_not_one_of_a_server_is_refused(data, file_url, transfer, tmp_path):
    for target in (f"sqlite:///{tmp_path / 'other.db'}", "mysql://host/lab", "runs"):
        with pytest.raises(CatalogueError, match="give postgresql://USER"):
            transfer(data, target)
    assert find_catalogue(data) == file_url


def test_a_folder_without_a_catalogue_is_refused_and_stays_as_it_is(tmp_path, server_url, transfer):
    with pytest.raises(CatalogueError, match="there is no catalogue"):
        transfer(tmp_path, server_url)
    assert list(tmp_path.iterdir()) == []


def test_a_server_that_does_not_answer_is_named(data, file_url, transfer):
    with pytest.raises(CatalogueError, match=r"127\.0\.0\.1:9/lab cannot be opened.*refused") as refused:
        transfer(data, "postgresql://mrbench:secret-word@127.0.0.1:9/lab")
    assert "secret-word" not in str(refused.value)
    assert_nothing_changed(data, file_url)


def test_a_missing_password_is_named_with_the_places_where_it_belongs(
    data, file_url, transfer, postgres_server, monkeypatch
):
    monkeypatch.delenv("PGPASSWORD", raising=False)
    url = postgres_server.make_database()
    rules = postgres_server.folder / "data" / "pg_hba.conf"
    before = rules.read_text()
    rules.write_text(f"local {make_url(url).database} all scram-sha-256\n{before}")
    postgres_server.execute("SELECT pg_reload_conf()")
    try:
        with pytest.raises(CatalogueError, match=r"no password supplied; give it in ~/\.pgpass, PGPASSWORD or"):
            transfer(data, url.replace(":secret-word@", "@"))
    finally:
        rules.write_text(before)
        postgres_server.execute("SELECT pg_reload_conf()")
    assert_nothing_changed(data, file_url)


def test_a_file_in_the_way_is_not_overwritten(data, server_url, transfer):
    transfer(data, server_url)
    for name in ("catalogue.db", "catalogue.db-wal"):
        (data / name).write_bytes(b"kept")
        with pytest.raises(CatalogueError, match=f"{name}: the file exists, and nothing is overwritten"):
            transfer(data, "sqlite")
        assert (data / name).read_bytes() == b"kept"
        (data / name).unlink()
    assert find_catalogue(data) == server_url


def test_a_row_that_the_server_refuses_is_named_and_the_target_stays_without_tables(
    data, file_url, transfer, postgres_server
):
    fill_for_search(file_url, data)
    with sqlite3.connect(data / "catalogue.db") as connection:
        connection.execute("UPDATE jobs SET summary = '{\"rmse_n\": NaN}' WHERE id = 'identify-3-1'")
    connection.close()
    before, url = read_all(file_url), postgres_server.make_database()
    with pytest.raises(
        CatalogueError, match=r"table jobs, row with id 'identify-3-1': the database refuses it.*json"
    ):
        transfer(data, url)
    assert list_tables(url) == []
    assert_nothing_changed(data, file_url)
    assert read_all(file_url) == before


def test_a_copy_that_differs_is_not_used(data, file_url, transfer, postgres_server, monkeypatch):
    fill_for_search(file_url, data)
    insert, url = copying._insert_at_once, postgres_server.make_database()

    def insert_wrongly(target, table, rows):
        place = table.columns.index("specimen") if table.name == "runs" else None
        changed = [(*row[:place], "other", *row[place + 1 :]) if place is not None else row for row in rows]
        insert(target, table, changed)

    def lose_notes(target, table, rows):
        if table.name != "notes":
            insert(target, table, rows)

    monkeypatch.setattr(copying, "_insert_at_once", insert_wrongly)
    with pytest.raises(CatalogueError, match=r"table runs, row with id 'run-1': the copy differs.* in specimen;"):
        transfer(data, url)
    monkeypatch.setattr(copying, "_insert_at_once", lose_notes)
    with pytest.raises(CatalogueError, match="table notes: 0 rows were copied, expected 1"):
        transfer(data, url)
    assert list_tables(url) == []
    assert_nothing_changed(data, file_url)


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_a_server_that_is_lost_in_the_middle_leaves_everything_as_it_was(
    data, file_url, server_url, postgres_server, share
):
    fill_all_tables(file_url)

    def interrupt(completed):
        if completed > share:
            postgres_server.disconnect(server_url)

    with pytest.raises(CatalogueUnavailableError, match="cannot be used at present"):
        transfer_catalogue(data, server_url, interrupt)
    assert not any(read_all(server_url).values())
    assert_nothing_changed(data, file_url)


def test_a_transfer_to_a_file_that_fails_leaves_no_file(server_data, server_url, transfer, monkeypatch):
    fill_for_search(server_url, server_data)
    insert = copying._insert_at_once

    def lose_notes(target, table, rows):
        if table.name != "notes":
            insert(target, table, rows)

    monkeypatch.setattr(copying, "_insert_at_once", lose_notes)
    with pytest.raises(CatalogueError, match="table notes: 0 rows were copied, expected 1"):
        transfer(server_data, "sqlite")
    assert sorted(path.name for path in server_data.iterdir()) == ["catalogue.url", "service.lock"]
    assert find_catalogue(server_data) == server_url

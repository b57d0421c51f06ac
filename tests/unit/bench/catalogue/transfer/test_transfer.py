"""Transfer of a catalogue between SQLite and PostgreSQL: content, searches, and the work that follows."""

import json

import pytest
from sqlalchemy import create_engine, inspect, text

from bench.catalogue import find_catalogue, keep_address, make_sqlite_url, open_catalogue
from bench.catalogue.database import parse_address
from bench.catalogue.models import Base
from tests.support.full_catalogues import (
    NUL,
    REPLACED,
    SEARCHES,
    fill_all_tables,
    fill_for_search,
    read_all,
    search,
)

COMPUTED = {"alembic_version", "newest_values", "runs.texts"}
"""Tables and columns that a database has beside those of the models; they are not copied."""


def execute(url, statement, **values):
    engine = create_engine(parse_address(url))
    with engine.begin() as connection:
        found = connection.execute(text(statement), values)
        rows = found.all() if found.returns_rows else []
    engine.dispose()
    return rows


def test_every_table_and_column_belongs_to_the_models_or_is_computed(data, server_url):
    """Otherwise a transfer would lose it."""
    for url in (make_sqlite_url(data / "catalogue.db"), server_url):
        engine = create_engine(parse_address(url))
        found = inspect(engine)
        names = set(found.get_table_names())
        copied = Base.metadata.tables
        surplus = names - set(copied)
        for name in names & set(copied):
            columns = {column["name"] for column in found.get_columns(name)}
            surplus |= {f"{name}.{column}" for column in columns - set(copied[name].columns.keys())}
        engine.dispose()
        assert set(copied) <= names
        assert surplus <= COMPUTED


def test_all_rows_come_to_postgresql_and_back(data, file_url, server_url, transfer):
    fill_all_tables(file_url)
    before = read_all(file_url)
    stored = (data / "catalogue.db").read_bytes()
    there = transfer(data, server_url)
    assert find_catalogue(data) == server_url
    assert (set(there.tables.values()), there.replaced) == ({2}, 0)
    assert read_all(server_url) == before
    assert (data / "catalogue.db").read_bytes() == stored
    (data / "catalogue.db").rename(data / "former.db")
    back = transfer(data, "sqlite")
    assert find_catalogue(data) == file_url
    assert back.tables == there.tables
    assert read_all(file_url) == before
    assert read_all(server_url) == before
    assert sorted(path.name for path in data.iterdir()) == ["catalogue.db", "former.db", "service.lock"]


def test_searches_find_the_same_runs_on_both_sides(data, file_url, server_url, transfer, postgres_server):
    fill_for_search(file_url, data)
    expected = search(file_url, data)
    assert {name for name, runs in expected.items() if not runs} == {"no text", "former effect"}
    assert set(expected) == set(SEARCHES)
    transfer(data, server_url)
    assert search(server_url, data) == expected
    values = postgres_server.execute(
        "SELECT kind, name, value FROM newest_values WHERE run_id = 'run-2'", server_url
    )
    assert sorted(values) == [("diagnose", "backlash", None), ("identify", "k0", 4.0)]
    (data / "catalogue.db").unlink()
    transfer(data, "sqlite")
    assert search(file_url, data) == expected


def test_new_rows_continue_the_numbers_of_the_copied_ones(data, file_url, server_url, transfer):
    fill_all_tables(file_url)
    (run, *_), numbers = execute(file_url, "SELECT id FROM runs")[0], []
    for target in (server_url, "sqlite"):
        transfer(data, target)
        with open_catalogue(data) as catalogue:
            catalogue.notebook.add_note(run, "A", "later")
        numbers.append([row.id for row in execute(find_catalogue(data), "SELECT id FROM notes ORDER BY id")])
        (data / "catalogue.db").unlink(missing_ok=True)
    assert numbers == [[41, 42, 43], [41, 42, 43, 44]]


def test_an_empty_catalogue_is_transferred(data, server_url, transfer):
    assert set(transfer(data, server_url).tables.values()) == {0}
    with open_catalogue(data) as catalogue:
        assert catalogue.list_runs(10) == []


def test_a_database_without_tables_gets_those_of_this_version(data, file_url, transfer, postgres_server):
    fill_all_tables(file_url)
    url = postgres_server.make_database()
    transfer(data, url)
    assert read_all(url) == read_all(file_url)


def test_nul_is_replaced_where_the_server_cannot_store_it(data, file_url, server_url, transfer):
    fill_for_search(file_url, data)
    execute(file_url, "UPDATE runs SET reason = :text WHERE id = 'run-1'", text=NUL)
    summary = {"effects": [NUL], "note": r"C:\u0000"}
    execute(file_url, "UPDATE jobs SET summary = :text WHERE id = 'diagnose-1-2'", text=json.dumps(summary))
    assert transfer(data, server_url).replaced == 2
    with open_catalogue(data) as catalogue:
        assert catalogue.get_run("run-1").reason == REPLACED
        job = catalogue.get_job("diagnose-1-2")
    assert job.summary == {"effects": [REPLACED], "note": r"C:\u0000"}


def test_a_missing_value_and_null_in_json_stay_apart(data, file_url, server_url, transfer):
    fill_for_search(file_url, data)
    execute(file_url, "UPDATE jobs SET summary = NULL WHERE id = 'identify-1-1'")
    execute(file_url, "UPDATE jobs SET summary = 'null' WHERE id = 'identify-2-1'")
    digits = '{"b": 1.10, "a":12345678901234567890.5}'
    execute(file_url, "UPDATE jobs SET summary = :text WHERE run_id = 'run-3'", text=digits)
    query = "SELECT id, CAST(summary AS TEXT) FROM jobs ORDER BY id"
    before = execute(file_url, query)
    transfer(data, server_url)
    assert execute(server_url, query) == before


def test_a_catalogue_moves_to_another_server(server_data, server_url, transfer, postgres_server):
    fill_all_tables(server_url)
    other = postgres_server.make_database()
    transfer(server_data, other)
    assert find_catalogue(server_data) == other
    assert read_all(other) == read_all(server_url)


def test_the_same_address_is_accepted_beside_the_former_file(data, server_url, transfer):
    transfer(data, server_url)
    keep_address(data, server_url)
    assert find_catalogue(data) == server_url


def test_the_completed_share_grows_to_one(data, file_url, server_url, monkeypatch):
    from bench.catalogue import transfer_catalogue

    fill_all_tables(file_url)
    shares = []
    transfer_catalogue(data, server_url, shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)

"""Detection of changes of a catalogue."""

import sqlite3
from datetime import UTC, datetime
from types import SimpleNamespace

from bench.catalogue.catalogue import Catalogue
from bench.catalogue.database import ChangeCounter, make_sqlite_url, open_database
from bench.catalogue.models import RunRow


def open_catalogue(folder):
    return Catalogue(open_database(make_sqlite_url(folder / "catalogue.db")), folder)


def add_run(catalogue, name):
    row = RunRow(id=name, method="quick", started=datetime(2026, 3, 1, tzinfo=UTC), state="ended", log=name)
    catalogue.add(row)


def test_the_number_changes_with_every_commit_and_with_nothing_else(tmp_path):
    catalogue = open_catalogue(tmp_path)
    numbers = [catalogue.change_counter.read()]
    for name in ("first", "second"):
        assert catalogue.get_run(name) is None
        assert catalogue.change_counter.read() == numbers[-1]
        add_run(catalogue, name)
        numbers.append(catalogue.change_counter.read())
    catalogue.close()
    assert len(set(numbers)) == 3


def test_a_commit_of_another_program_counts(tmp_path):
    catalogue = open_catalogue(tmp_path)
    add_run(catalogue, "first")
    before = catalogue.change_counter.read()
    other = sqlite3.connect(tmp_path / "catalogue.db")
    other.execute("UPDATE runs SET operator = 'A. Meyer'")
    assert catalogue.change_counter.read() == before
    other.commit()
    other.close()
    assert catalogue.change_counter.read() != before
    catalogue.close()


def test_a_database_without_such_a_number_has_none():
    assert ChangeCounter(SimpleNamespace(dialect=SimpleNamespace(name="postgresql"))).read() is None

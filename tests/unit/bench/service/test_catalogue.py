"""The catalogue's tables, and what it learns from logs."""

import os
import sqlite3
from datetime import UTC, datetime, timedelta, timezone

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from service_logs import cut_off_log, whole_log

from bench.catalogue.catalogue import Catalogue
from bench.catalogue.database import open_database, sqlite_url
from bench.catalogue.errors import CatalogueError
from bench.catalogue.log_facts import has_end, read_facts
from bench.catalogue.models import Base, JobRow, RunRow
from bench.catalogue.scan import scan
from bench.errors import LogError


def nobody(path):
    return False


@pytest.fixture
def catalogue(tmp_path):
    made = Catalogue(open_database(sqlite_url(tmp_path / "catalogue.db")), tmp_path)
    yield made
    made.close()


def run(number, **changes):
    given = {
        "id": f"run-{number}",
        "method": "quick",
        "started": datetime(2026, 3, 1, 10, number, tzinfo=UTC),
        "state": "ended",
        "log": f"run-{number}.mcap",
    }
    return RunRow(**{**given, **changes})


def job(number, **changes):
    given = {"id": f"job-{number}", "run_id": "run-1", "key": "k", "settings": {}, "state": "queued"}
    return JobRow(**{**given, "created": datetime(2026, 3, 1, 11, number, tzinfo=UTC), **changes})


def test_migrations_lead_to_the_tables_of_the_models(tmp_path):
    engine = open_database(sqlite_url(tmp_path / "catalogue.db"))
    with engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []
    engine.dispose()


def test_a_catalogue_is_opened_again_with_what_stands_in_it(tmp_path):
    url = sqlite_url(tmp_path / "catalogue.db")
    for number in (1, 2):
        made = Catalogue(open_database(url), tmp_path)
        made.add(run(number))
        assert len(made.runs(10)) == number
        made.close()


def test_readers_never_wait_for_a_writer(catalogue):
    with sqlite3.connect(catalogue.folder / "catalogue.db") as other:
        assert other.execute("PRAGMA journal_mode").fetchone() == ("wal",)
        other.execute("BEGIN IMMEDIATE")
        assert catalogue.runs(10) == []
    other.close()


def test_a_catalogue_of_a_later_version_is_refused(tmp_path):
    path = tmp_path / "catalogue.db"
    open_database(sqlite_url(path)).dispose()
    with sqlite3.connect(path) as other:
        other.execute("UPDATE alembic_version SET version_num = '9999'")
    other.close()
    with pytest.raises(CatalogueError, match="later version"):
        open_database(sqlite_url(path))


def test_what_is_no_catalogue_is_refused_by_name(tmp_path):
    path = tmp_path / "catalogue.db"
    path.write_text("not a database, but text that is long enough to be taken for one" * 20)
    with pytest.raises(CatalogueError, match=r"catalogue\.db"):
        open_database(sqlite_url(path))


def test_times_come_back_in_utc(catalogue):
    there = datetime(2026, 3, 1, 12, 0, tzinfo=timezone(timedelta(hours=2)))
    catalogue.add(run(1, started=there))
    assert catalogue.run("run-1").started == there
    assert catalogue.run("run-1").started.tzinfo is UTC


def test_runs_of_the_same_instant_are_all_found_page_by_page(catalogue):
    same = datetime(2026, 3, 1, 10, 0, tzinfo=UTC)
    for number in range(5):
        catalogue.add(run(number, started=same))
    found, before = [], None
    while page := catalogue.runs(2, before):
        found += [row.id for row in page]
        before = page[-1]
    assert found == [f"run-{number}" for number in (4, 3, 2, 1, 0)]


def test_a_job_is_added_once_unless_the_last_one_came_to_nothing(catalogue):
    catalogue.add(run(1))
    assert catalogue.add_job_once(job(1))[1]
    assert catalogue.add_job_once(job(2))[0].id == "job-1"
    catalogue.change_job("job-1", state="failed")
    assert catalogue.add_job_once(job(3))[1]
    assert catalogue.change_job("job-1", state="running") is None


def test_a_log_tells_its_facts_whole_or_cut_off(tmp_path):
    whole = read_facts(whole_log(tmp_path / "a.mcap", "a", "lossy", first_s=2.5))
    assert (whole.id, whole.specimen, whole.operator, whole.outcome) == ("a", "damper 7", "M. Curie", "lossy")
    assert whole.started == datetime(2026, 3, 1, 10, 0, 2, 500_000, tzinfo=UTC)
    assert whole.duration_s == pytest.approx(1.998)
    cut_off = read_facts(cut_off_log(tmp_path / "b.mcap", "b"))
    assert (cut_off.id, cut_off.specimen, cut_off.outcome) == ("b", "damper 7", None)
    assert (has_end(tmp_path / "a.mcap"), has_end(tmp_path / "b.mcap")) == (True, False)


def test_what_is_no_log_is_passed_over(catalogue):
    (catalogue.folder / "foreign.mcap").write_bytes(b"\x89MCAP0\r\n" + b"\0" * 100)
    (catalogue.folder / "empty.mcap").write_bytes(b"")
    assert scan(catalogue, nobody) == []
    with pytest.raises(LogError):
        read_facts(catalogue.folder / "empty.mcap")


def test_a_scan_finds_what_is_new_and_nothing_twice(catalogue):
    whole_log(catalogue.folder / "a.mcap", "a")
    assert [row.id for row in scan(catalogue, nobody)] == ["a"]
    assert scan(catalogue, nobody) == []
    assert catalogue.run("a").log == "a.mcap"
    assert len(catalogue.run("a").log_sha256) == 64


def test_a_log_that_is_still_written_is_left_alone(catalogue):
    cut_off_log(catalogue.folder / "a.mcap", "a")
    assert scan(catalogue, lambda path: True) == []
    assert [row.state for row in scan(catalogue, nobody)] == ["cut_off"]


def test_a_log_that_changed_is_looked_at_again(catalogue):
    path = cut_off_log(catalogue.folder / "a.mcap", "a")
    scan(catalogue, nobody)
    whole_log(path, "a")
    os.utime(path, ns=(1, 1))
    (row,) = scan(catalogue, nobody)
    assert (row.state, row.outcome) == ("ended", "clean")


def test_a_copy_of_a_log_is_no_second_run(catalogue):
    whole_log(catalogue.folder / "a.mcap", "a")
    whole_log(catalogue.folder / "b.mcap", "a")
    assert [row.log for row in scan(catalogue, nobody)] == ["a.mcap"]

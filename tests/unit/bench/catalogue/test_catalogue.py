"""Tables of the catalogue, their migrations, and the scan of logs."""

import json
import os
import sqlite3
from datetime import UTC, datetime, timedelta, timezone

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from sqlalchemy import create_engine, text

from bench.catalogue.catalogue import Catalogue
from bench.catalogue.database import make_sqlite_url, open_database
from bench.catalogue.errors import CatalogueError
from bench.catalogue.log_summary import is_complete, read_log_summary
from bench.catalogue.models import Base, JobRow, RunRow
from bench.catalogue.run_filter import RunFilter
from bench.catalogue.scan import scan_logs
from bench.errors import LogError
from tests.support.certificates import make_certificate
from tests.support.service_logs import write_complete_log, write_truncated_log

POSTGRES_ONLY = ("newest_values", "texts", "runs_texts", "notes_texts")
"""Table, column and indices of a search that SQLite does without."""


def not_being_written(path):
    return False


@pytest.fixture
def catalogue(tmp_path, catalogue_url):
    catalogue = Catalogue(open_database(catalogue_url), tmp_path)
    yield catalogue
    catalogue.close()


def run(number, **changes):
    values = {
        "id": f"run-{number}",
        "method": "quick",
        "started": datetime(2026, 3, 1, 10, number, tzinfo=UTC),
        "state": "ended",
        "log": f"run-{number}.mcap",
    }
    return RunRow(**{**values, **changes})


def test_migrations_create_the_tables_of_the_models(catalogue_url):
    engine = open_database(catalogue_url)
    options = {"include_object": lambda one, name, kind, reflected, to: name not in POSTGRES_ONLY}
    with engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection, opts=options), Base.metadata) == []
    engine.dispose()


def migrate_to(url, revision):
    """Create or change a database as the version of mrbench with this revision did."""
    engine = create_engine(url)
    config = Config()
    config.set_main_option("script_location", "bench.catalogue:migrations")
    with engine.begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, revision)
    return engine


def test_a_catalogue_of_revision_0001_is_opened_and_its_state_renamed(tmp_path):
    url = make_sqlite_url(tmp_path / "catalogue.db")
    engine = migrate_to(url, "0001")
    columns = "id, method, specimen, operator, source, started, state, reason, log"
    started = "2026-03-01 10:00:00.000000"
    with engine.begin() as connection:
        for name, state in (("a", "cut_off"), ("b", "ended")):
            values = f"'{name}', 'quick', '', '', 'run', '{started}', '{state}', '', '{name}.mcap'"
            connection.exec_driver_sql(f"INSERT INTO runs ({columns}) VALUES ({values})")
        job = f"'j', 'a', 'identify', 'k', '{{}}', 'running', 1, '{started}', 'identify', ''"
        columns = "id, run_id, kind, key, settings, state, attempts, created, doing, error"
        connection.exec_driver_sql(f"INSERT INTO jobs ({columns}) VALUES ({job})")
    engine.dispose()
    catalogue = Catalogue(open_database(url), tmp_path)
    assert {row.id: row.state for row in catalogue.list_runs(10)} == {"a": "truncated", "b": "ended"}
    job = catalogue.get_job("j")
    assert (job.activity, job.submissions, job.retries, job.inputs) == ("identify", 1, [], {})
    assert catalogue.update_job("j", activity="report").activity == "report"
    catalogue.close()


def test_what_older_catalogues_have_of_the_only_bench_belongs_to_it(tmp_path, catalogue_url):
    engine = migrate_to(catalogue_url, "0018")
    at, document = "2026-03-01 10:00:00", json.dumps(make_certificate())
    certificate = {"id": "c", "version": 1, "channel": "force", "document": document, "created": at,
                   "created_by": "ada", "reason": ""}  # fmt: skip
    run = {"id": "a", "method": "quick", "specimen": "", "operator": "", "source": "run", "started": at,
           "state": "ended", "reason": "", "log": "a.mcap", "tags": "[]", "revision": 0}  # fmt: skip
    with engine.begin() as connection:
        for table, row in (("certificates", certificate), ("runs", run)):
            places = ", ".join(f":{name}" for name in row)
            connection.execute(text(f"INSERT INTO {table} ({', '.join(row)}) VALUES ({places})"), row)
    engine.dispose()
    catalogue = Catalogue(open_database(catalogue_url), tmp_path)
    today = datetime.now(UTC).date()
    assert set(catalogue.certificates.list_current(today)) == {"force"}
    assert catalogue.certificates.list_current(today, "left") == {}
    assert catalogue.get_run("a").bench is None
    assert catalogue.list_runs(9, selection=RunFilter(bench="left")) == []
    catalogue.close()


@pytest.mark.parametrize(
    ("outcome", "reason", "ending"),
    [
        ("clean", "", "completed"),
        ("lossy", "", "completed"),
        ("incomplete", "stopped on request", "stopped"),
        ("incomplete", "the agent was shut down", "stopped"),
        ("incomplete", "force 1600 N exceeds the limit of 1500 N", "tripped"),
        ("incomplete", "the rig agent ended before it wrote a log", None),
        ("truncated", "the recorder was killed; repaired by salvage", None),
        (None, "", None),
    ],
)
def test_the_ending_of_an_older_run_is_derived_where_it_is_determined(tmp_path, outcome, reason, ending):
    url = make_sqlite_url(tmp_path / "catalogue.db")
    engine = migrate_to(url, "0002")
    values = ["a", "quick", "", "", "run", "2026-03-01 10:00:00.000000", "ended", outcome, reason, "a.mcap"]
    columns = "id, method, specimen, operator, source, started, state, outcome, reason, log"
    with engine.begin() as connection:
        connection.exec_driver_sql(f"INSERT INTO runs ({columns}) VALUES (?,?,?,?,?,?,?,?,?,?)", tuple(values))
    engine.dispose()
    catalogue = Catalogue(open_database(url), tmp_path)
    assert catalogue.get_run("a").ending == ending
    catalogue.close()


@pytest.mark.parametrize("ending", ["stopped", "aborted", "tripped"])
def test_the_ending_in_a_log_is_that_of_its_run(catalogue, ending):
    write_complete_log(catalogue.folder / "a.mcap", "a", outcome="incomplete", ending=ending)
    (row,) = scan_logs(catalogue, not_being_written)
    assert (row.outcome, row.ending) == ("incomplete", ending)


def test_a_catalogue_keeps_its_rows_when_it_is_opened_again(tmp_path, catalogue_url):
    for number in (1, 2):
        catalogue = Catalogue(open_database(catalogue_url), tmp_path)
        catalogue.add(run(number))
        assert len(catalogue.list_runs(10)) == number
        catalogue.close()


@pytest.mark.parametrize("catalogue_url", ["sqlite"], indirect=True)
def test_readers_never_wait_for_a_writer(catalogue):
    with sqlite3.connect(catalogue.folder / "catalogue.db") as other:
        assert other.execute("PRAGMA journal_mode").fetchone() == ("wal",)
        other.execute("BEGIN IMMEDIATE")
        assert catalogue.list_runs(10) == []
    other.close()


def test_a_catalogue_of_a_later_version_is_refused(tmp_path):
    path = tmp_path / "catalogue.db"
    open_database(make_sqlite_url(path)).dispose()
    with sqlite3.connect(path) as other:
        other.execute("UPDATE alembic_version SET version_num = '9999'")
    other.close()
    with pytest.raises(CatalogueError, match="later version"):
        open_database(make_sqlite_url(path))


def test_a_file_that_is_not_a_database_is_refused_by_name(tmp_path):
    path = tmp_path / "catalogue.db"
    path.write_text("not a database, but text that is long enough to be taken for one" * 20)
    with pytest.raises(CatalogueError, match=r"catalogue\.db"):
        open_database(make_sqlite_url(path))


def test_times_are_returned_in_utc(catalogue):
    started = datetime(2026, 3, 1, 12, 0, tzinfo=timezone(timedelta(hours=2)))
    catalogue.add(run(1, started=started))
    assert catalogue.get_run("run-1").started == started
    assert catalogue.get_run("run-1").started.tzinfo is UTC


def test_runs_of_the_same_instant_are_all_found_page_by_page(catalogue):
    same = datetime(2026, 3, 1, 10, 0, tzinfo=UTC)
    for number in range(5):
        catalogue.add(run(number, started=same))
    ids, before = [], None
    while page := catalogue.list_runs(2, before):
        ids += [row.id for row in page]
        before = page[-1]
    assert ids == [f"run-{number}" for number in (4, 3, 2, 1, 0)]


def test_the_summary_of_a_log_is_read_complete_or_truncated(tmp_path):
    complete = read_log_summary(write_complete_log(tmp_path / "a.mcap", "a", "lossy", first_s=2.5))
    identity = (complete.id, complete.specimen, complete.operator, complete.outcome)
    assert identity == ("a", "damper 7", "M. Curie", "lossy")
    assert complete.started == datetime(2026, 3, 1, 10, 0, 2, 500_000, tzinfo=UTC)
    assert complete.duration_s == pytest.approx(1.998)
    truncated = read_log_summary(write_truncated_log(tmp_path / "b.mcap", "b"))
    assert (truncated.id, truncated.specimen, truncated.outcome) == ("b", "damper 7", None)
    assert (is_complete(tmp_path / "a.mcap"), is_complete(tmp_path / "b.mcap")) == (True, False)


def test_files_that_are_not_logs_are_skipped(catalogue):
    (catalogue.folder / "foreign.mcap").write_bytes(b"\x89MCAP0\r\n" + b"\0" * 100)
    (catalogue.folder / "empty.mcap").write_bytes(b"")
    assert scan_logs(catalogue, not_being_written) == []
    with pytest.raises(LogError):
        read_log_summary(catalogue.folder / "empty.mcap")


def test_a_scan_finds_each_new_log_once(catalogue):
    write_complete_log(catalogue.folder / "a.mcap", "a")
    assert [row.id for row in scan_logs(catalogue, not_being_written)] == ["a"]
    assert scan_logs(catalogue, not_being_written) == []
    assert catalogue.get_run("a").log == "a.mcap"
    assert len(catalogue.get_run("a").log_sha256) == 64


def test_a_log_that_is_being_written_is_skipped(catalogue):
    write_truncated_log(catalogue.folder / "a.mcap", "a")
    assert scan_logs(catalogue, lambda path: True) == []
    assert [row.state for row in scan_logs(catalogue, not_being_written)] == ["truncated"]


def test_a_changed_log_is_read_again(catalogue):
    path = write_truncated_log(catalogue.folder / "a.mcap", "a")
    scan_logs(catalogue, not_being_written)
    write_complete_log(path, "a")
    os.utime(path, ns=(1, 1))
    (row,) = scan_logs(catalogue, not_being_written)
    assert (row.state, row.outcome) == ("ended", "clean")


def test_a_copy_of_a_log_is_not_a_second_run(catalogue):
    write_complete_log(catalogue.folder / "a.mcap", "a")
    write_complete_log(catalogue.folder / "b.mcap", "a")
    assert [row.log for row in scan_logs(catalogue, not_being_written)] == ["a.mcap"]


def test_the_newest_done_job_of_each_kind_is_found_behind_any_number_of_others(catalogue):
    for number in (1, 2):
        catalogue.add(run(number))
        for kind in ("identify", "diagnose"):
            for age, state in enumerate(["done", "done", *["cancelled"] * 50]):
                name = f"{number}-{kind}-{age}"
                created = datetime(2026, 3, 1, 11, age, tzinfo=UTC)
                values = {"key": "k", "settings": {}, "state": state, "created": created}
                catalogue.add(JobRow(id=name, run_id=f"run-{number}", kind=kind, **values))
    found = catalogue.list_jobs_of_runs(["run-1", "run-2"], 3)
    for number in (1, 2):
        jobs = [one for one in found if one.run_id == f"run-{number}"]
        assert len(jobs) == 5
        assert {one.id for one in jobs if one.state == "done"} == {
            f"{number}-{k}-1" for k in ("identify", "diagnose")
        }
        assert [one.created for one in jobs] == sorted((one.created for one in jobs), reverse=True)


def test_a_file_that_is_skipped_is_logged_once_for_each_reason(catalogue, caplog):
    foreign = catalogue.folder / "foreign.mcap"
    foreign.write_bytes(b"not a log")
    write_complete_log(catalogue.folder / "a.mcap", "a")
    write_complete_log(catalogue.folder / "b.mcap", "a")
    for _ in range(3):
        scan_logs(catalogue, not_being_written)
    skipped = [record.log for record in caplog.records if record.message == "log_skipped"]
    assert skipped == [str(catalogue.folder / "b.mcap"), str(foreign)]
    write_complete_log(foreign, "a")
    scan_logs(catalogue, not_being_written)
    assert [record.log for record in caplog.records if record.message == "log_skipped"][2:] == [str(foreign)]

"""Logs that are removed from this machine after their copy, and fetched when they are needed."""

from datetime import UTC, datetime

import fsspec
import pytest

from bench.catalogue import JobRow, check_all, check_integrity, compute_sha256, scan_logs
from bench.log_store import LocalLogs, LogCopier, LogStoreError, LogStoreUnavailableError, hash_object, local_logs
from tests.unit.bench.log_store.test_copier import damage


@pytest.fixture
def logs(catalogue, store):
    """Local logs, all of them copied."""
    LogCopier(catalogue, store).copy_due()
    return LocalLogs(catalogue)


def list_logs(catalogue):
    return sorted(path.name for path in catalogue.folder.iterdir() if "mcap" in path.name)


def hash_copy(url):
    return hash_object(url)[0]


def test_logs_stay_until_their_copies_are_old_enough(logs, catalogue):
    logs.remove_old(1.0)
    assert list_logs(catalogue) == ["a.mcap", "b.mcap"]
    logs.remove_old(0.0)
    assert list_logs(catalogue) == []
    assert catalogue.get_run("a").removed is not None


def test_a_removed_log_is_not_missing_and_its_copy_can_be_checked(logs, catalogue):
    logs.remove_old(0.0)
    assert scan_logs(catalogue, lambda path: False) == []
    row = check_integrity(catalogue, catalogue.get_run("a"))
    assert (row.integrity, row.checked) == (None, None), "without the store nothing is known"
    assert [row.integrity for row in check_all(catalogue, hash_copy)] == ["intact", "intact"]
    damage(row.copy_url)
    row = check_integrity(catalogue, row, hash_copy)
    assert (row.integrity, row.found_sha256) == ("changed", hash_copy(row.copy_url))


def test_a_removed_log_is_fetched_as_it_was(logs, catalogue):
    path = catalogue.folder / "a.mcap"
    before = path.stat()
    logs.remove_old(0.0)
    assert logs.locate(catalogue.get_run("a")) == path
    row = catalogue.get_run("a")
    assert compute_sha256(path) == row.log_sha256
    assert path.stat().st_mtime_ns == before.st_mtime_ns
    assert row.removed is None
    assert row.fetched >= row.copied
    assert scan_logs(catalogue, lambda path: False) == []
    logs.remove_old(1.0)
    assert path.exists()


def test_a_corrupted_copy_is_refused_and_leaves_no_file(logs, catalogue):
    logs.remove_old(0.0)
    row = catalogue.get_run("a")
    damage(row.copy_url)
    with pytest.raises(LogStoreError, match="has another content than the recorded log"):
        logs.locate(row)
    assert list_logs(catalogue) == []
    assert catalogue.get_run("a").removed is not None


def test_a_log_whose_copy_was_lost_or_damaged_stays_and_is_copied_again(logs, catalogue, store):
    damage(catalogue.get_run("a").copy_url)
    files, path = fsspec.url_to_fs(catalogue.get_run("b").copy_url)
    files.rm(path)
    logs.remove_old(0.0)
    assert list_logs(catalogue) == ["a.mcap", "b.mcap"]
    assert [catalogue.get_run(name).copy_url for name in ("a", "b")] == [None, None]
    LogCopier(catalogue, store).copy_due()
    assert hash_copy(catalogue.get_run("a").copy_url) == catalogue.get_run("a").log_sha256
    logs.remove_old(0.0)
    assert list_logs(catalogue) == []


def test_a_log_that_a_job_needs_stays(logs, catalogue):
    job = JobRow(id="1", run_id="a", key="1", settings={"runs": ["b"]}, state="queued", created=datetime.now(UTC))
    catalogue.add(job)
    logs.remove_old(0.0)
    assert list_logs(catalogue) == ["a.mcap", "b.mcap"]
    catalogue.update_job("1", state="done")
    logs.remove_old(0.0)
    assert list_logs(catalogue) == []


def test_a_store_that_is_away_is_named_and_the_log_can_be_fetched_later(logs, catalogue, monkeypatch):
    def fail(url):
        raise LogStoreUnavailableError("the log store does not answer")

    logs.remove_old(0.0)
    with monkeypatch.context() as away:
        away.setattr(local_logs, "read_blocks", fail)
        with pytest.raises(LogStoreUnavailableError):
            logs.locate(catalogue.get_run("a"))
    assert logs.locate(catalogue.get_run("a")).exists()


def test_a_log_without_a_copy_has_its_path(catalogue):
    assert LocalLogs(catalogue).locate(catalogue.get_run("a")) == catalogue.folder / "a.mcap"

"""Logs that were changed or deleted after they were recorded."""

import os

import pytest
from typer.testing import CliRunner

from bench.catalogue.catalogue import Catalogue
from bench.catalogue.database import SQLITE, keep_address, open_database, parse_address
from bench.catalogue.integrity import check_all, check_integrity
from bench.catalogue.log_summary import compute_sha256
from bench.catalogue.scan import scan_logs
from bench.errors import LogError
from tests.support.service_logs import write_complete_log, write_truncated_log


@pytest.fixture
def catalogue(tmp_path, catalogue_url):
    """Catalogue of one recorded log."""
    catalogue = Catalogue(open_database(catalogue_url), tmp_path)
    write_complete_log(tmp_path / "a.mcap", "a")
    scan(catalogue)
    yield catalogue
    catalogue.close()


def scan(catalogue):
    return scan_logs(catalogue, lambda path: False)


def flip_byte(path, *, keep_time):
    """Change one byte in the middle of a file, with or without its time of modification."""
    stat = path.stat()
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns + (0 if keep_time else 10**9)))


def test_a_change_that_keeps_size_and_time_is_found_on_demand(catalogue):
    path, recorded = catalogue.folder / "a.mcap", catalogue.get_run("a").log_sha256
    assert check_integrity(catalogue, catalogue.get_run("a")).integrity == "intact"
    flip_byte(path, keep_time=True)
    assert scan(catalogue) == []
    (row,) = check_all(catalogue)
    assert (row.integrity, row.log_sha256, row.found_sha256) == ("changed", recorded, compute_sha256(path))
    assert row.checked is not None


def test_a_changed_log_is_never_hashed_again_in_silence(catalogue, caplog):
    recorded = catalogue.get_run("a")
    flip_byte(catalogue.folder / "a.mcap", keep_time=False)
    (row,) = scan(catalogue)
    assert (row.integrity, row.log_sha256) == ("changed", recorded.log_sha256)
    assert (row.outcome, row.duration_s) == (recorded.outcome, recorded.duration_s)
    assert scan(catalogue) == []
    assert [record.message for record in caplog.records] == ["log_changed"]


def test_a_deleted_log_is_missing_until_it_is_restored(catalogue):
    path = catalogue.folder / "a.mcap"
    path.rename(catalogue.folder / "elsewhere")
    (row,) = scan(catalogue)
    assert (row.integrity, row.found_sha256) == ("missing", None)
    assert scan(catalogue) == []
    (catalogue.folder / "elsewhere").rename(path)
    (row,) = scan(catalogue)
    assert row.integrity == "intact"


def test_a_log_without_a_stored_hash_cannot_be_checked(catalogue):
    write_truncated_log(catalogue.folder / "b.mcap", "b")
    scan(catalogue)
    with pytest.raises(LogError, match="run b is truncated and has no complete log"):
        check_integrity(catalogue, catalogue.get_run("b"))
    assert [row.id for row in check_all(catalogue)] == ["a"]


def verify(folder):
    from importlib.metadata import EntryPoint

    from bench.cli import _make_application

    entry = EntryPoint("verify", "bench.commands.verify:verify", "mrbench.commands")
    return CliRunner().invoke(_make_application([entry]), ["verify", str(folder)])


def test_the_command_names_changed_and_missing_logs(catalogue, catalogue_url):
    if parse_address(catalogue_url).drivername != SQLITE:
        keep_address(catalogue.folder, catalogue_url)
    done = verify(catalogue.folder)
    assert (done.exit_code, done.output) == (0, "1 of 1 logs are unchanged since they were recorded\n")
    flip_byte(catalogue.folder / "a.mcap", keep_time=True)
    recorded = catalogue.get_run("a").log_sha256
    done = verify(catalogue.folder)
    assert f"a.mcap: changed: recorded {recorded}, found " in done.output
    assert "0 of 1 logs are unchanged" in done.output
    assert isinstance(done.exception, LogError)
    assert catalogue.get_run("a").integrity == "changed"


def test_the_command_creates_no_catalogue(tmp_path):
    done = verify(tmp_path)
    assert "there is no catalogue" in str(done.exception)
    assert list(tmp_path.iterdir()) == []

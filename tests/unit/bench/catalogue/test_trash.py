"""Trash of the catalogue."""

import pytest

from bench.catalogue import (
    Catalogue,
    RunFilter,
    move_to_trash,
    open_database,
    restore_from_trash,
    scan_logs,
)
from bench.errors import LogError
from tests.support.service_logs import write_complete_log


@pytest.fixture
def catalogue(tmp_path, catalogue_url):
    catalogue = Catalogue(open_database(catalogue_url), tmp_path)
    write_complete_log(tmp_path / "one.mcap")
    scan(catalogue)
    yield catalogue
    catalogue.close()


def scan(catalogue):
    return scan_logs(catalogue, lambda path: False)


def list_ids(catalogue, *, trash):
    return [row.id for row in catalogue.list_runs(10, selection=RunFilter(is_trashed=trash))]


def test_a_run_moves_to_the_trash_with_its_log_and_back(catalogue, tmp_path):
    content = (tmp_path / "one.mcap").read_bytes()
    trashed = move_to_trash(catalogue, catalogue.get_run("run-1"))
    assert trashed.trashed is not None
    assert (tmp_path / "trash" / "one.mcap").read_bytes() == content
    assert scan(catalogue) == []
    assert (list_ids(catalogue, trash=False), list_ids(catalogue, trash=True)) == ([], ["run-1"])
    restored = restore_from_trash(catalogue, trashed)
    assert (restored.trashed, restored.log) == (None, "one.mcap")
    assert (tmp_path / "one.mcap").read_bytes() == content
    assert scan(catalogue) == []


def test_a_move_that_was_killed_before_its_record_is_completed(catalogue, tmp_path):
    (tmp_path / "trash").mkdir()
    (tmp_path / "one.mcap").rename(tmp_path / "trash" / "one.mcap")
    assert move_to_trash(catalogue, catalogue.get_run("run-1")).log == "trash/one.mcap"


def test_another_file_in_the_place_is_not_overwritten(catalogue, tmp_path):
    trashed = move_to_trash(catalogue, catalogue.get_run("run-1"))
    (tmp_path / "one.mcap").write_text("another")
    with pytest.raises(LogError, match=r"another file is in the place of one\.mcap"):
        restore_from_trash(catalogue, trashed)
    assert (tmp_path / "one.mcap").read_text() == "another"


def test_a_log_outside_the_data_folder_stays(catalogue):
    row = catalogue.update_run("run-1", log="/elsewhere/one.mcap")
    assert restore_from_trash(catalogue, move_to_trash(catalogue, row)).log == "/elsewhere/one.mcap"

"""Catalogue of two recorded logs, and an empty store in a folder or in memory."""

import fsspec
import pytest

from bench.catalogue import Catalogue, open_database, scan_logs
from tests.support.empty_catalogues import write_empty_catalogue
from tests.support.service_logs import write_complete_log


@pytest.fixture
def catalogue(tmp_path):
    folder = tmp_path / "runs"
    folder.mkdir()
    catalogue = Catalogue(open_database(write_empty_catalogue(folder)), folder)
    for name in ("a", "b"):
        write_complete_log(folder / f"{name}.mcap", name)
    scan_logs(catalogue, lambda path: False)
    yield catalogue
    catalogue.close()


@pytest.fixture(params=["file", "memory"])
def store(request, tmp_path):
    if request.param == "file":
        (tmp_path / "store").mkdir()
        return f"file://{tmp_path / 'store'}"
    files = fsspec.filesystem("memory")
    files.store.clear()
    return "memory://bucket/prefix"

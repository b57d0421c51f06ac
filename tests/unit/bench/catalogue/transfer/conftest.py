"""A transfer without progress, and data folders with a catalogue in each kind of database."""

import pytest

from bench.catalogue import keep_address, make_sqlite_url, open_database, transfer_catalogue
from bench.catalogue.transfer import copying
from tests.support.full_catalogues import make_file


@pytest.fixture
def transfer(monkeypatch):
    """Provide a transfer in batches of three rows."""
    monkeypatch.setattr(copying, "BATCH", 3)
    return lambda data, target: transfer_catalogue(data, target, lambda share: None)


@pytest.fixture
def data(tmp_path):
    """Provide a data folder with an empty SQLite catalogue."""
    folder = tmp_path / "runs"
    make_file(folder)
    return folder


@pytest.fixture
def file_url(data):
    return make_sqlite_url(data / "catalogue.db")


@pytest.fixture
def server_url(postgres_server):
    """Provide an empty catalogue in PostgreSQL."""
    return postgres_server.make_catalogue()


@pytest.fixture
def server_data(tmp_path, server_url):
    """Provide a data folder with an empty catalogue in PostgreSQL."""
    folder = tmp_path / "served"
    folder.mkdir()
    keep_address(folder, server_url)
    open_database(server_url).dispose()
    return folder

"""Empty SQLite catalogues. The migrations run once in a process, because they take longer than most tests."""

import functools
import tempfile
from pathlib import Path

from bench.catalogue import CATALOGUE_FILE, make_sqlite_url, open_database


@functools.cache
def read_empty_catalogue():
    """Return the content of an empty catalogue."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / CATALOGUE_FILE
        open_database(make_sqlite_url(path)).dispose()
        assert [file.name for file in path.parent.iterdir()] == [CATALOGUE_FILE]
        return path.read_bytes()


def write_empty_catalogue(folder):
    """Write an empty catalogue to a folder, and return its URL."""
    path = folder / CATALOGUE_FILE
    path.write_bytes(read_empty_catalogue())
    return make_sqlite_url(path)

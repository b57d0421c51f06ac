"""Catalogue of a data folder, opened by a command; a running service reads a change within seconds."""

import getpass
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bench.catalogue import Catalogue


@contextmanager
def open_catalogue(data: Path) -> Iterator["Catalogue"]:
    """Open the catalogue of a data folder, and create it if it is missing.

    Raises:
        BenchError: folder or catalogue cannot be opened.
    """
    from bench.catalogue import CATALOGUE_FILE, Catalogue, make_sqlite_url, open_database
    from bench.errors import RunError

    folder = data.resolve()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RunError(f"{folder} cannot be created: {error.strerror}; use another --data") from None
    catalogue = Catalogue(open_database(make_sqlite_url(folder / CATALOGUE_FILE)), folder)
    try:
        yield catalogue
    finally:
        catalogue.close()


def get_local_actor() -> str:
    """Return the name of the person at this terminal, for the record."""
    return f"local:{getpass.getuser()}"

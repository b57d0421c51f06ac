"""Transfer of the catalogue of a data folder to another database."""

from contextlib import AbstractContextManager
from pathlib import Path
from typing import NamedTuple

from sqlalchemy import Connection

from bench.catalogue.database import (
    ADDRESS_FILE,
    CATALOGUE_FILE,
    SQLITE,
    describe_address,
    find_catalogue,
    make_sqlite_url,
    parse_address,
    parse_server_address,
)
from bench.catalogue.errors import CatalogueError
from bench.catalogue.transfer.copying import Advance, TableCount, compare_table, copy_table
from bench.catalogue.transfer.source import open_source
from bench.catalogue.transfer.stored_tables import count_rows, list_tables
from bench.catalogue.transfer.targets import open_file, open_server
from bench.folder_lock import hold_lock
from bench.progress import Progress

FILE_TARGET = SQLITE
"""Name of the SQLite file of the data folder as a target, in place of a URL."""


class Transferred(NamedTuple):
    """Result of a transfer."""

    source: str
    """Address of the former database, without secrets."""
    target: str
    """Address of the database that the data folder uses from now on, without secrets."""
    tables: dict[str, int]
    """Number of rows by table, in the order of the copy."""
    replaced: int
    """Number of texts in which NUL was replaced, because PostgreSQL cannot store it."""


def transfer_catalogue(data: Path, target: str, progress: Progress) -> Transferred:
    """Copy the catalogue of a data folder to an empty database, compare both, and use the new one from then on.

    The copy is one transaction, and the source is read at one moment, in which nobody else can change it. If
    anything fails or differs, the folder keeps its database, and the target stays as it was. The source keeps its
    rows. Logs and results stay where they are.

    Args:
        data: data folder; no service uses it.
        target: URL of an empty PostgreSQL database, or `FILE_TARGET` for a new SQLite file in the data folder.
        progress: receives the completed share.

    Raises:
        CatalogueError: source or target cannot be used, or the copy differs.
        SecretFileError: other users may read the address of the catalogue, or it cannot be written.
    """
    source = find_catalogue(data)
    shown = _describe_target(data, source, target)
    try:
        with hold_lock(data) as is_free:
            if not is_free:
                raise CatalogueError(
                    f"{data}: a service uses the data folder, or another transfer; nothing was transferred; end "
                    "it, and repeat"
                )
            with open_source(source) as original, _open_target(data, target) as copy:
                counts = _copy_all(original, copy, progress)
    except OSError as error:
        raise CatalogueError(
            f"{data}: the catalogue was not transferred ({error.strerror or error}); make the folder writable, "
            "and repeat"
        ) from error
    return Transferred(
        describe_address(parse_address(source)),
        shown,
        {name: count.rows for name, count in counts.items()},
        sum(count.replaced for count in counts.values()),
    )


def _describe_target(data: Path, source: str, target: str) -> str:
    """Return the target for a person.

    Raises:
        CatalogueError: it is not an address of PostgreSQL, or the source is in such a file already.
    """
    if target != FILE_TARGET:
        return describe_address(parse_server_address(target))
    if not (data / ADDRESS_FILE).is_file():
        raise CatalogueError(
            f"{source}: the catalogue is in SQLite already; nothing was transferred; give --catalogue with the "
            "URL of an empty PostgreSQL database"
        )
    return make_sqlite_url(data / CATALOGUE_FILE)


def _open_target(data: Path, target: str) -> AbstractContextManager[Connection]:
    return open_file(data) if target == FILE_TARGET else open_server(data, target)


def _copy_all(source: Connection, target: Connection, progress: Progress) -> dict[str, TableCount]:
    """Copy and compare all tables, and return the counts of each."""
    tables = list_tables()
    advance = _make_advance(2 * sum(count_rows(source, table) for table in tables), progress)
    counts = {table.name: copy_table(source, target, table, advance) for table in tables}
    for table in tables:
        compare_table(source, target, table, advance)
    return counts


def _make_advance(total: int, progress: Progress) -> Advance:
    """Return a function that adds up rows and reports the completed share."""
    handled = 0

    def advance(rows: int) -> None:
        nonlocal handled
        handled += rows
        progress(handled / total)

    return advance

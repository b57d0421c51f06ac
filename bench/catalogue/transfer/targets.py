"""Targets of a transfer: a PostgreSQL database or a new SQLite file, filled completely or left as it was."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import URL, Connection, inspect, text

from bench.catalogue.database import (
    ADDRESS_FILE,
    CATALOGUE_FILE,
    describe_address,
    make_sqlite_url,
    migrate,
    parse_address,
    write_address,
)
from bench.catalogue.errors import CatalogueError
from bench.catalogue.transfer.connections import claim_database, open_transaction, wait_without_limit
from bench.catalogue.transfer.stored_tables import count_rows, list_tables

PARTIAL_FILE = f".{CATALOGUE_FILE}.part"
"""File in a data folder with the copy that is being written."""
_COMPANIONS = ("", "-wal", "-shm", "-journal")
"""Endings of the files of one SQLite database."""


@contextmanager
def open_server(folder: Path, url: str) -> Iterator[Connection]:
    """Provide a transaction in an empty PostgreSQL database, which has the tables of this version.

    Once the block has ended without an error, it is committed, and the data folder keeps the address. Otherwise
    nothing is changed.

    Raises:
        CatalogueError: the database cannot be opened, is not empty or is the source.
    """
    address = parse_address(url)
    written = write_address(folder, url)
    try:
        with open_transaction(address, lambda connection: _prepare_server(connection, address)) as connection:
            yield connection
            _finish_server(connection)
            connection.commit()
        written.replace(folder / ADDRESS_FILE)
    finally:
        written.unlink(missing_ok=True)


@contextmanager
def open_file(folder: Path) -> Iterator[Connection]:
    """Provide a transaction in a new SQLite file of a data folder, which has the tables of this version.

    Once the block has ended without an error, the file becomes the catalogue of the folder. Otherwise nothing is
    changed.

    Raises:
        CatalogueError: the folder has such a file, or it cannot be written.
    """
    own, partial = folder / CATALOGUE_FILE, folder / PARTIAL_FILE
    if present := next((path for path in _list_companions(own) if path.exists()), None):
        raise CatalogueError(
            f"{present}: the file exists, and nothing is overwritten; it is not used since the catalogue is in "
            "PostgreSQL; move it to another folder"
        )
    _remove_file(partial)
    try:
        with open_transaction(parse_address(make_sqlite_url(partial)), migrate) as connection:
            yield connection
            connection.commit()
        partial.replace(own)
        # Only now does the folder name the file instead of the server.
        (folder / ADDRESS_FILE).unlink()
    finally:
        _remove_file(partial)


def _prepare_server(connection: Connection, address: URL) -> None:
    shown = describe_address(address)
    wait_without_limit(connection)
    claim_database(connection, shown)
    _check_empty(connection, shown)
    migrate(connection)


def _check_empty(connection: Connection, shown: str) -> None:
    names = set(inspect(connection).get_table_names())
    if names and "alembic_version" not in names:
        raise CatalogueError(
            f"{shown}: the database has {len(names)} tables of another program; nothing was changed; give an "
            "empty database"
        )
    for table in list_tables():
        rows = count_rows(connection, table) if table.name in names else 0
        if rows:
            raise CatalogueError(
                f"{shown}: the table {table.name} of the database has {rows} rows, allowed 0; nothing was "
                "changed; give an empty database"
            )


def _finish_server(connection: Connection) -> None:
    """Let new rows continue the numbers of the copied ones, and collect the statistics for searches."""
    for table in list_tables():
        if table.has_numbered_rows and count_rows(connection, table):
            (key,) = table.keys
            sequence = f"pg_get_serial_sequence('{table.name}', '{key}')"
            connection.execute(text(f"SELECT setval({sequence}, (SELECT max({key}) FROM {table.name}))"))
    names = ", ".join(table.name for table in list_tables())
    connection.execute(text(f"ANALYZE {names}, newest_values"))


def _list_companions(path: Path) -> list[Path]:
    return [path.with_name(f"{path.name}{ending}") for ending in _COMPANIONS]


def _remove_file(path: Path) -> None:
    for one in _list_companions(path):
        one.unlink(missing_ok=True)

"""Source of a transfer: the catalogue at one moment, while nobody else changes it."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy import URL, Connection, text
from sqlalchemy.exc import OperationalError

from bench.catalogue.database import SQLITE, describe_address, get_reason, open_database, parse_address
from bench.catalogue.errors import CatalogueError
from bench.catalogue.transfer.connections import claim_database, open_transaction, wait_without_limit
from bench.catalogue.transfer.stored_tables import list_tables

_PATIENCE, _PERIOD = 5.0, 0.1
"""[s] Time for processes that are ending to disconnect, and time between two looks at them."""
_OTHERS = (
    "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() AND application_name = 'mrbench' "
    "AND pid <> pg_backend_pid()"
)


@contextmanager
def open_source(url: str) -> Iterator[Connection]:
    """Provide a transaction that shows a catalogue at one moment; nobody else can change it until the block ends.

    Args:
        url: address of the catalogue. The migrations that it lacks are run first.

    Raises:
        CatalogueError: it cannot be opened, or another process uses it.
    """
    open_database(url).dispose()
    address = parse_address(url)
    with open_transaction(address, lambda connection: _lock_source(connection, address)) as connection:
        yield connection


def _lock_source(connection: Connection, address: URL) -> None:
    shown = describe_address(address)
    if address.drivername != SQLITE:
        _lock_server(connection, shown)
        return
    try:
        # Refused while any other process has the file open, even if it does nothing at present.
        connection.exec_driver_sql("PRAGMA locking_mode=EXCLUSIVE")
        connection.exec_driver_sql("BEGIN IMMEDIATE")
    except OperationalError as error:
        raise CatalogueError(_describe_use(shown, get_reason(error))) from error


def _lock_server(connection: Connection, shown: str) -> None:
    # The lock is taken before the first query, because that one determines the moment which is shown.
    connection.execution_options(isolation_level="REPEATABLE READ")
    names = ", ".join(table.name for table in list_tables())
    try:
        connection.execute(text(f"LOCK TABLE {names} IN SHARE MODE"))
    except OperationalError as error:
        raise CatalogueError(_describe_use(shown, get_reason(error))) from error
    wait_without_limit(connection)
    deadline = time.monotonic() + _PATIENCE
    while others := connection.execute(text(_OTHERS)).scalar_one():
        if time.monotonic() > deadline:
            raise CatalogueError(_describe_use(shown, f"{others} connections, allowed 0"))
        time.sleep(_PERIOD)
        connection.execute(text("SELECT pg_stat_clear_snapshot()"))
    claim_database(connection, shown)


def _describe_use(shown: str, reason: str) -> str:
    return (
        f"another process uses the catalogue {shown} ({reason}); nothing was transferred; end the services and "
        "commands that use it, such as `mrbench campaign`, and repeat"
    )

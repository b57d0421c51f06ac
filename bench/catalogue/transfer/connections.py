"""Transactions of a transfer, and what both of its PostgreSQL databases have in common."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

from sqlalchemy import URL, Connection, text

from bench.catalogue.database import explain_failed_opening, make_engine, report_outages
from bench.catalogue.errors import CatalogueError

_TRANSFER_LOCK = 0x6D726274
"""Number of the server's lock of a database that takes part in a transfer."""


@contextmanager
def open_transaction(address: URL, prepare: Callable[[Connection], None]) -> Iterator[Connection]:
    """Provide a connection after a preparation; what the block does not commit is undone."""
    with ExitStack() as stack:
        with explain_failed_opening(address):
            engine = make_engine(address)
            stack.callback(engine.dispose)
            connection = stack.enter_context(engine.connect())
            prepare(connection)
        report_outages(engine, address)
        yield connection


def wait_without_limit(connection: Connection) -> None:
    """Let the transaction stay open while the other side reads or writes."""
    connection.execute(text("SET LOCAL idle_in_transaction_session_timeout = 0"))


def claim_database(connection: Connection, shown: str) -> None:
    """Claim a database for this transaction, so that it is not source and target, or part of two transfers.

    Args:
        connection: connection to PostgreSQL.
        shown: address of the database for a person.

    Raises:
        CatalogueError: it is claimed already.
    """
    query = text("SELECT pg_try_advisory_xact_lock(:number)")
    if not connection.execute(query, {"number": _TRANSFER_LOCK}).scalar_one():
        raise CatalogueError(
            f"{shown}: the database is the source of this transfer, or another transfer uses it; nothing was "
            "transferred; give another database that is empty"
        )

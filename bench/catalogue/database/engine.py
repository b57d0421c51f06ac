"""Connection to the database of a catalogue, with the migration of its tables to this version."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from alembic.util import CommandError
from sqlalchemy import URL, Connection, Engine, create_engine, event
from sqlalchemy.engine import ExceptionContext
from sqlalchemy.exc import (
    DataError,
    DBAPIError,
    IntegrityError,
    NotSupportedError,
    ProgrammingError,
    SQLAlchemyError,
)

from bench.catalogue.database import postgres
from bench.catalogue.database.address import SQLITE, describe_address, parse_address
from bench.catalogue.errors import CatalogueError, CatalogueUnavailableError

_PRAGMAS = ("journal_mode=WAL", "synchronous=NORMAL", "foreign_keys=ON", "busy_timeout=5000")
"""SQLite settings. With a write-ahead log readers never wait for a writer, and a kill loses no committed data."""
_OWN_ERRORS = (IntegrityError, DataError, ProgrammingError, NotSupportedError)
"""Errors of a statement, in contrast to those of the connection, the server or the disk."""
_NO_PASSWORD = "no password supplied"
"""Words of libpq where a server asks for a password and none is found."""


def open_database(url: str) -> Engine:
    """Connect to a database and run the migrations that it lacks.

    Args:
        url: address, such as ``sqlite:///runs/catalogue.db`` or ``postgresql://USER:PASSWORD@HOST/DATABASE``.

    Raises:
        CatalogueError: the database cannot be opened, is not a database, or was written by a later version.
    """
    address = parse_address(url)
    with explain_failed_opening(address):
        engine = make_engine(address)
        try:
            with engine.begin() as connection:
                migrate(connection)
        except BaseException:
            engine.dispose()  # otherwise connections and the lock of an SQLite file stay until garbage collection
            raise
    report_outages(engine, address)
    return engine


@contextmanager
def explain_failed_opening(address: URL) -> Iterator[None]:
    """Raise errors of ours in place of those by which a database cannot be opened or migrated.

    Raises:
        CatalogueError: the database cannot be opened, is not a database, or was written by a later version.
    """
    shown = describe_address(address)
    try:
        yield
    except CommandError as error:
        raise CatalogueError(
            f"the catalogue {shown} was written by a later version ({error}); use that version of mrbench"
        ) from error
    except ImportError as error:
        raise CatalogueError(f"psycopg is missing ({error}); pip install 'mrbench[postgres]'") from error
    except SQLAlchemyError as error:
        reason = get_reason(error)
        hint = "; give it in ~/.pgpass, PGPASSWORD or MRBENCH_CATALOGUE" if _NO_PASSWORD in reason else ""
        raise CatalogueError(f"the catalogue {shown} cannot be opened: {reason}{hint}") from error


def report_outages(engine: Engine, address: URL) -> None:
    """Let errors of the connection, the server or the disk become `CatalogueUnavailableError` from now on."""
    shown = describe_address(address)
    event.listen(engine, "handle_error", lambda context: _raise_unavailable(context, shown))


def make_engine(address: URL) -> Engine:
    """Return an engine for a database; nothing is connected yet, and no migration is run.

    Raises:
        ImportError: psycopg is not installed.
    """
    if address.drivername != SQLITE:
        return postgres.create_engine(address)
    engine = create_engine(address)
    event.listen(engine, "connect", _set_pragmas)
    return engine


def _set_pragmas(connection: Any, record: object) -> None:
    execute: Callable[[str], object] = connection.execute
    for pragma in _PRAGMAS:
        execute(f"PRAGMA {pragma}")


def _raise_unavailable(context: ExceptionContext, shown: str) -> None:
    """Raise an error of ours in place of one of the connection, the server or the disk."""
    error = context.sqlalchemy_exception
    # A failed check of a pooled connection is followed by a new connection.
    if context.is_pre_ping or not isinstance(error, DBAPIError) or isinstance(error, _OWN_ERRORS):
        return
    cause = _get_first_line(context.original_exception)
    raise CatalogueUnavailableError(f"the catalogue {shown} cannot be used at present: {cause}; try again")


def get_reason(error: SQLAlchemyError) -> str:
    """Return the cause of an error in one line."""
    return _get_first_line(error.orig if isinstance(error, DBAPIError) else error)


def _get_first_line(error: BaseException | None) -> str:
    lines = str(error).splitlines() or [type(error).__name__]
    return lines[0]


def migrate(connection: Connection) -> None:
    """Run the migrations that a database lacks, in the transaction of a connection.

    Raises:
        CommandError: a later version has written the database.
        SQLAlchemyError: the database cannot be read or written.
    """
    config = Config()
    config.set_main_option("script_location", "bench.catalogue:migrations")
    if connection.dialect.name != SQLITE:
        postgres.wait_for_other_migrations(connection)
    elif MigrationContext.configure(connection).get_current_heads() == _get_heads(config):
        return
    else:
        # Two processes may open a new folder at once. The second waits here, and then finds the tables. The driver
        # begins a transaction only at the first change of a row; the tables belong to it as well.
        connection.exec_driver_sql("BEGIN IMMEDIATE")
    config.attributes["connection"] = connection
    command.upgrade(config, "head")


def _get_heads(config: Config) -> tuple[str, ...]:
    """Return the revisions of this version."""
    return tuple(ScriptDirectory.from_config(config).get_heads())

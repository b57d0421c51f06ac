"""Connection to the database of a catalogue, with the migration of its tables to this version."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from alembic import command
from alembic.config import Config
from alembic.util import CommandError
from sqlalchemy import Engine, create_engine, event
from sqlalchemy.exc import SQLAlchemyError

from bench.catalogue.errors import CatalogueError

CATALOGUE_FILE = "catalogue.db"
"""File of the catalogue in a data folder."""
_PRAGMAS = ("journal_mode=WAL", "synchronous=NORMAL", "foreign_keys=ON", "busy_timeout=5000")
"""SQLite settings. With a write-ahead log readers never wait for a writer, and a kill loses no committed data."""


def make_sqlite_url(path: Path) -> str:
    """Return the address of an SQLite file."""
    return f"sqlite:///{path}"


def find_catalogue(folder: Path) -> str:
    """Return the address of the SQLite catalogue in a data folder.

    Raises:
        CatalogueError: the folder contains none.
    """
    path = folder / CATALOGUE_FILE
    if not path.is_file():
        raise CatalogueError(f"{path}: there is no catalogue; give the data folder of `mrbench serve`")
    return make_sqlite_url(path)


def open_database(url: str) -> Engine:
    """Connect to a database and run the migrations that it lacks.

    Args:
        url: SQLAlchemy address, such as ``sqlite:///runs/catalogue.db`` or ``postgresql+psycopg://…``.

    Raises:
        CatalogueError: the database cannot be opened, is not a database, or was written by a later version.
    """
    try:
        engine = create_engine(url)
        if engine.dialect.name == "sqlite":
            event.listen(engine, "connect", _set_pragmas)
        try:
            _migrate(engine)
        except BaseException:
            engine.dispose()  # otherwise connections and the lock of an SQLite file stay until garbage collection
            raise
    except CommandError as error:
        raise CatalogueError(
            f"the catalogue {url} was written by a later version ({error}); use that version of mrbench"
        ) from error
    except (SQLAlchemyError, ImportError) as error:
        raise CatalogueError(f"the catalogue {url} cannot be opened: {str(error).splitlines()[0]}") from error
    return engine


def _set_pragmas(connection: Any, record: object) -> None:
    execute: Callable[[str], object] = connection.execute
    for pragma in _PRAGMAS:
        execute(f"PRAGMA {pragma}")


def _migrate(engine: Engine) -> None:
    config = Config()
    config.set_main_option("script_location", "bench.catalogue:migrations")
    with engine.begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, "head")

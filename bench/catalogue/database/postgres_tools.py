"""Dump and restoration of a PostgreSQL database by PostgreSQL's own programs."""

import os
import shutil
import subprocess
from pathlib import Path

from sqlalchemy import URL, create_engine, inspect, text
from sqlalchemy.exc import SQLAlchemyError

from bench.catalogue.database.address import describe_address
from bench.catalogue.errors import CatalogueError

_OPTIONS = ("--no-owner", "--no-privileges")
"""Owners and rights belong to the server, not to the data."""


def dump_database(address: URL, dump: Path) -> int:
    """Write a database to a new file as it is at one moment, and return its number of runs.

    Raises:
        CatalogueError: `pg_dump` is missing or fails, such as on a server of a later version.
    """
    engine = create_engine(address, isolation_level="REPEATABLE READ")
    try:
        with engine.connect() as connection:
            # The dump shows the moment of this transaction, so that the number is that of the dump.
            snapshot = connection.execute(text("SELECT pg_export_snapshot()")).scalar_one()
            runs = connection.execute(text("SELECT count(*) FROM runs")).scalar_one()
            words = (*_OPTIONS, f"--snapshot={snapshot}", f"--file={dump}")
            _call("pg_dump", address, "--format=custom", *words)
    except SQLAlchemyError as error:
        raise _explain(address, error) from error
    finally:
        engine.dispose()
    return int(runs)


def restore_database(dump: Path, address: URL) -> int:
    """Write a dump into an empty database, all of it or nothing, and return its number of runs.

    Raises:
        CatalogueError: the database has tables already, or `pg_restore` is missing or fails.
    """
    engine = create_engine(address)
    try:
        if tables := inspect(engine).get_table_names():
            shown = describe_address(address)
            raise CatalogueError(
                f"{shown}: the database has {len(tables)} tables; nothing was changed; give an empty one"
            )
        _call("pg_restore", address, *_OPTIONS, "--exit-on-error", "--single-transaction", str(dump))
        with engine.connect() as connection:
            return int(connection.execute(text("SELECT count(*) FROM runs")).scalar_one())
    except SQLAlchemyError as error:
        raise _explain(address, error) from error
    finally:
        engine.dispose()


def _explain(address: URL, error: SQLAlchemyError) -> CatalogueError:
    shown = describe_address(address)
    return CatalogueError(f"the catalogue {shown} cannot be read: {str(error).splitlines()[0]}")


def _call(program: str, address: URL, *words: str) -> None:
    """Call a program of PostgreSQL on a database; other users of the machine do not see the password."""
    found = shutil.which(program)
    if found is None:
        raise CatalogueError(f"{program} is not installed; install the package postgresql-client")
    shown = address.set(drivername="postgresql", password=None).render_as_string()
    secret = {} if address.password is None else {"PGPASSWORD": str(address.password)}
    done = subprocess.run(
        [found, f"--dbname={shown}", *words],
        env=os.environ | secret,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or [f"status {done.returncode}"]
        raise CatalogueError(f"{describe_address(address)}: {program} failed: {lines[0]}")

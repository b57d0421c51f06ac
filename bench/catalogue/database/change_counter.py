"""Detection of changes of a catalogue, by any process."""

import sqlite3
from contextlib import closing
from threading import Lock

from sqlalchemy import Engine, PoolProxiedConnection


class ChangeCounter:
    """Counter of the commits to a database; safe from any thread.

    It holds a connection of its own, because SQLite counts only the commits of other connections for each. Each
    request reads the number, so it is read without the statements of SQLAlchemy, which take longer than the query.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine, self._lock = engine, Lock()
        self._connection: PoolProxiedConnection | None = None

    def read(self) -> int | None:
        """Return a number that another commit makes different; None where the database tells none."""
        if self._engine.dialect.name != "sqlite":
            return None
        try:
            with self._lock, closing(self._open().cursor()) as cursor:
                cursor.execute("PRAGMA data_version")
                ((number,),) = cursor.fetchall()
                return int(number)
        except sqlite3.Error:  # the answer is then read from the catalogue, whose error says more
            return None

    def _open(self) -> PoolProxiedConnection:
        if self._connection is None:
            self._connection = self._engine.raw_connection()
        return self._connection

    def close(self) -> None:
        """Close the connection."""
        with self._lock:
            if self._connection is not None:
                self._connection.close()
                self._connection = None

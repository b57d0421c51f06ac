"""Detection of changes of a catalogue, by any process."""

from threading import Lock

from sqlalchemy import Connection, Engine


class ChangeCounter:
    """Counter of the commits to a database; safe from any thread.

    It holds a connection of its own, because SQLite counts only the commits of other connections for each.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine, self._lock = engine, Lock()
        self._connection: Connection | None = None

    def read(self) -> int | None:
        """Return a number that another commit makes different; None for a database that has none."""
        if self._engine.dialect.name != "sqlite":
            return None
        with self._lock:
            if self._connection is None:
                self._connection = self._engine.connect()
            return int(self._connection.exec_driver_sql("PRAGMA data_version").scalar_one())

    def close(self) -> None:
        """Close the connection."""
        with self._lock:
            if self._connection is not None:
                self._connection.close()
                self._connection = None

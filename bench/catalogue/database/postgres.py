"""Connections to PostgreSQL: time limits, text without NUL, and locks."""

import importlib
from typing import Any

import sqlalchemy
from sqlalchemy import URL, Connection, Engine, event, text

_PARAMETERS: dict[str, Any] = {
    "application_name": "mrbench",
    "connect_timeout": 5,  # [s] within which the server must accept a connection
    "prepare_threshold": None,  # a plan that fits one text or range can be slow for another
    "tcp_user_timeout": 15_000,  # [ms] after which a network that swallows all packets counts as interrupted
}
"""Parameters of a connection; the URL may contain others."""
_LOCK_TIMEOUT = 10
"""Longest time [s] for which a statement waits for the transaction of another process."""
_IDLE_TIMEOUT = 60
"""Time [s] after which the server ends a transaction of a process that has disappeared."""
_CONNECTIONS, _FURTHER_CONNECTIONS = 10, 50
"""Connections that are kept, and more for many threads at once; a server accepts 100 by default."""
_MIGRATION_LOCK = 0x6D726263
"""Number of the server's lock that one migrating process holds."""


def create_engine(address: URL) -> Engine:
    """Return an engine for a PostgreSQL database; nothing is connected yet.

    Raises:
        ImportError: psycopg is not installed.
    """
    engine = sqlalchemy.create_engine(
        address,
        # A connection that the server has closed is replaced before it is used.
        pool_pre_ping=True,
        pool_size=_CONNECTIONS,
        max_overflow=_FURTHER_CONNECTIONS,
        hide_parameters=True,
        connect_args={name: value for name, value in _PARAMETERS.items() if name not in address.query},
    )
    event.listen(engine, "connect", _make_set_up())
    return engine


def wait_for_other_migrations(connection: Connection) -> None:
    """Let one process at a time migrate a database, until its transaction ends."""
    connection.execute(text("SET LOCAL lock_timeout = 0"))
    connection.execute(text("SELECT pg_advisory_xact_lock(:number)"), {"number": _MIGRATION_LOCK})


def _make_set_up() -> Any:
    """Return the function that sets up a new connection."""
    strings = importlib.import_module("psycopg.types.string")

    class TextDumper(strings.StrDumperUnknown):  # type: ignore[misc, name-defined]
        """Writer of text; the server cannot store NUL, which a log or a request may contain."""

        def dump(self, obj: str) -> Any:
            return super().dump(obj.replace("\0", "\N{REPLACEMENT CHARACTER}"))

    def set_up(connection: Any, record: object) -> None:
        connection.adapters.register_dumper(str, TextDumper)
        with connection.cursor() as cursor:
            cursor.execute(f"SET lock_timeout = '{_LOCK_TIMEOUT}s'")
            cursor.execute(f"SET idle_in_transaction_session_timeout = '{_IDLE_TIMEOUT}s'")
        connection.commit()

    return set_up

"""Transactions that read a table and then write it, and that no other process may interrupt."""

from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy import Engine, text
from sqlalchemy.orm import DeclarativeBase, Session

from bench.catalogue.database.address import SQLITE


@contextmanager
def begin_write(engine: Engine, table: type[DeclarativeBase] | None = None) -> Iterator[Session]:
    """Provide a session in which what was read stays as it is; the caller commits.

    Args:
        engine: SQLite has one writer at a time. In PostgreSQL other writers of the table wait, readers do not.
        table: table in which a missing row counts, too; None where the query locks the rows that it reads.
    """
    with Session(engine, expire_on_commit=False) as session:
        if engine.dialect.name == SQLITE:
            session.connection().exec_driver_sql("BEGIN IMMEDIATE")
        elif table is not None:
            session.execute(text(f"LOCK TABLE {table.__tablename__} IN SHARE ROW EXCLUSIVE MODE"))
        yield session

"""Tables of a catalogue with their values as the database stores them, so that a copy changes none.

JSON is read and written as its text: numbers keep all their digits, and a null in JSON stays apart from a missing
value. Columns that the database computes itself (`runs.texts` in PostgreSQL) and the table that its triggers fill
(`newest_values`) are not part of the models, and so they are not copied.
"""

from collections.abc import Generator
from typing import Any, NamedTuple, TypeAlias

from sqlalchemy import (
    JSON,
    BigInteger,
    Cast,
    ColumnElement,
    Connection,
    DateTime,
    Enum,
    Integer,
    Table,
    TableClause,
    Text,
    cast,
    column,
    func,
    select,
    table,
)
from sqlalchemy.types import TypeEngine, UserDefinedType

from bench.catalogue.database import POSTGRES
from bench.catalogue.models import Base, UtcTime

BATCH = 1000
"""Number of rows that are read, and written, at once."""
StoredRow: TypeAlias = tuple[Any, ...]
"""Values of one row in the order of the columns."""


class StoredJson(UserDefinedType[str]):
    """Column type for JSON as its text."""

    cache_ok = True

    def get_col_spec(self, **_: object) -> str:
        """Return the name of the type in the database."""
        return "JSON"

    def column_expression(self, colexpr: ColumnElement[Any]) -> Cast[str]:
        """Read the text instead of the value."""
        return cast(colexpr, Text)


class StoredTable(NamedTuple):
    """One table, without the conversions of the models."""

    name: str
    clause: TableClause
    columns: tuple[str, ...]
    keys: tuple[str, ...]
    """Columns of the primary key."""
    json_places: tuple[int, ...]
    """Places of the columns with JSON."""
    has_numbered_rows: bool
    """The primary key is a number that the database assigns."""

    def name_row(self, row: StoredRow) -> str:
        """Return the primary key of a row for a person."""
        values = dict(zip(self.columns, row, strict=True))
        return ", ".join(f"{key} {values[key]!r}" for key in self.keys)


def list_tables() -> list[StoredTable]:
    """Return all tables of a catalogue; a table comes after those that it refers to."""
    return [_make_stored_table(one) for one in Base.metadata.sorted_tables]


def _make_stored_table(model: Table) -> StoredTable:
    keys = tuple(one.name for one in model.primary_key.columns)
    return StoredTable(
        name=model.name,
        clause=table(model.name, *(column(one.name, _find_stored_type(one.type)) for one in model.columns)),
        columns=tuple(one.name for one in model.columns),
        keys=keys,
        json_places=tuple(place for place, one in enumerate(model.columns) if isinstance(one.type, JSON)),
        has_numbered_rows=len(keys) == 1 and isinstance(model.columns[keys[0]].type, Integer | BigInteger),
    )


def _find_stored_type(model: TypeEngine[Any]) -> TypeEngine[Any]:
    if isinstance(model, JSON):
        return StoredJson()
    if isinstance(model, Enum):  # a value of an earlier version is copied, too
        return Text()
    return DateTime() if isinstance(model, UtcTime) else model


def read_rows(connection: Connection, source: StoredTable) -> Generator[StoredRow, None, None]:
    """Yield the rows of a table in the order of their primary keys, which is the same in every database.

    The caller closes the generator: a server keeps the query open until then.
    """
    order = [_sort_by(source.clause.c[key], connection.dialect.name) for key in source.keys]
    query = select(*source.clause.c).order_by(*order)
    with connection.execute(query, execution_options={"yield_per": BATCH}) as result:
        for row in result:
            yield tuple(row)


def _sort_by(key: ColumnElement[Any], dialect: str) -> ColumnElement[Any]:
    # SQLite compares the bytes of texts; PostgreSQL otherwise follows the rules of a language.
    is_text = isinstance(key.type, Text)
    return key.collate("C") if dialect == POSTGRES and is_text else key


def count_rows(connection: Connection, counted: StoredTable) -> int:
    """Return the number of rows of a table."""
    return connection.execute(select(func.count()).select_from(counted.clause)).scalar_one()

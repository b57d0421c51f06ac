"""Copy of the rows of a table to another database, and the comparison of both tables."""

from collections.abc import Callable, Sequence
from contextlib import closing
from itertools import islice, zip_longest
from typing import NamedTuple, TypeAlias

from sqlalchemy import Connection, insert
from sqlalchemy.exc import DBAPIError

from bench.catalogue.database import POSTGRES, get_reason
from bench.catalogue.errors import CatalogueError
from bench.catalogue.transfer.storable_text import replace_nul
from bench.catalogue.transfer.stored_tables import BATCH, StoredRow, StoredTable, count_rows, read_rows

Advance: TypeAlias = Callable[[int], None]
"""Callback that receives the number of rows that were handled since the last call."""


class TableCount(NamedTuple):
    """Rows of one table that were copied."""

    rows: int
    replaced: int
    """Number of texts in which NUL was replaced, because PostgreSQL cannot store it."""


def copy_table(source: Connection, target: Connection, table: StoredTable, advance: Advance) -> TableCount:
    """Copy all rows of a table, and return their number.

    Raises:
        CatalogueError: the target refuses a row.
    """
    rows, replaced = 0, 0
    with closing(read_rows(source, table)) as originals:
        while batch := [_adapt(row, target, table) for row in islice(originals, BATCH)]:
            _insert(target, table, [row for row, _ in batch])
            rows += len(batch)
            replaced += sum(count for _, count in batch)
            advance(len(batch))
    return TableCount(rows, replaced)


def compare_table(source: Connection, target: Connection, table: StoredTable, advance: Advance) -> None:
    """Compare all rows of a table with their copies.

    Raises:
        CatalogueError: a row differs, is missing or is surplus.
    """
    counts = [count_rows(connection, table) for connection in (source, target)]
    if counts[0] != counts[1]:
        raise CatalogueError(
            f"table {table.name}: {counts[1]} rows were copied, expected {counts[0]}; nothing was changed; repeat "
            "the transfer"
        )
    with closing(read_rows(source, table)) as originals, closing(read_rows(target, table)) as copies:
        pairs = zip_longest((_adapt(row, target, table)[0] for row in originals), copies)
        while batch := list(islice(pairs, BATCH)):
            for original, copy in batch:
                _compare(table, original, copy)
            advance(len(batch))


def _compare(table: StoredTable, original: StoredRow | None, copy: StoredRow | None) -> None:
    # As text, a number that is not defined equals itself.
    if original == copy or repr(original) == repr(copy):
        return
    named = table.name_row(original or copy or ())
    different = [
        name for name, *both in zip(table.columns, original or (), copy or (), strict=False) if both[0] != both[1]
    ]
    raise CatalogueError(
        f"table {table.name}, row with {named}: the copy differs from the original in "
        f"{', '.join(different) or 'its key'}; nothing was changed; repeat the transfer"
    )


def _adapt(row: StoredRow, target: Connection, table: StoredTable) -> tuple[StoredRow, int]:
    """Return a row as the target can store it, and the number of texts that were changed for this."""
    return replace_nul(row, table.json_places) if target.dialect.name == POSTGRES else (row, 0)


def _insert(target: Connection, table: StoredTable, rows: Sequence[StoredRow]) -> None:
    try:
        _insert_at_once(target, table, rows)
    except DBAPIError:
        # One by one, to name the row. If each is accepted alone, the error was not that of a row.
        for row in rows:
            _insert_one(target, table, row)


def _insert_one(target: Connection, table: StoredTable, row: StoredRow) -> None:
    try:
        _insert_at_once(target, table, [row])
    except DBAPIError as error:
        raise CatalogueError(
            f"table {table.name}, row with {table.name_row(row)}: the database refuses it "
            f"({get_reason(error)}); nothing was changed; correct the row in the source, and repeat the transfer"
        ) from error


def _insert_at_once(target: Connection, table: StoredTable, rows: Sequence[StoredRow]) -> None:
    values = [dict(zip(table.columns, row, strict=True)) for row in rows]
    with target.begin_nested():
        target.execute(insert(table.clause), values)

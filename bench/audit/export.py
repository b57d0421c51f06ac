"""Export of an audit trail with its head, as JSON or CSV."""

import csv
import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Final, Literal, TypeAlias, get_args

from bench.audit.entry import AuditEntry, Head
from bench.audit.lines import parse_entry
from bench.errors import AuditError

ExportFormat: TypeAlias = Literal["json", "csv"]
EXPORT_FORMATS: Final[tuple[ExportFormat, ...]] = get_args(ExportFormat)
"""Formats of an export."""
_COLUMNS = tuple(AuditEntry.model_fields)
_FORMULA = ("=", "+", "-", "@", "\t", "\r")
"""First characters by which a spreadsheet takes a text as a formula."""


def export_entries(path: Path, head: Head, form: ExportFormat) -> Iterator[str]:
    """Yield the text of an export, entry by entry, up to the entry of the head.

    JSON contains head and entries. CSV has one column for each field, and the head in its last line.

    Args:
        path: file of the trail.
        head: last entry.
        form: format.

    Raises:
        AuditError: the file cannot be read.
    """
    entries = _read_entries(path, head)
    yield from _export_json(entries, head) if form == "json" else _export_csv(entries, head)


def _read_entries(path: Path, head: Head) -> Iterator[AuditEntry]:
    if head.seq == 0:
        return
    try:
        with path.open("rb") as file:
            for line in file:
                entry = parse_entry(line)
                if entry is not None:
                    yield entry
                    if entry.seq == head.seq:
                        return
    except OSError as error:
        raise AuditError(f"{path}: the audit trail cannot be read ({error.strerror})") from error


def _export_json(entries: Iterator[AuditEntry], head: Head) -> Iterator[str]:
    yield f'{{"schema": "mrbench.audit/1", "head": "{head}", "entries": ['
    separator = "\n"
    for entry in entries:
        yield separator + entry.to_line().decode("ascii").rstrip("\n")
        separator = ",\n"
    yield "\n]}\n"


def _export_csv(entries: Iterator[AuditEntry], head: Head) -> Iterator[str]:
    yield _format_row(_COLUMNS)
    for entry in entries:
        yield _format_row([_format_cell(value) for value in entry.model_dump().values()])
    yield _format_row(["head", str(head)])


def _format_row(cells: tuple[str, ...] | list[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue()


def _format_cell(value: object) -> str:
    if isinstance(value, dict | list):
        return json.dumps(value, sort_keys=True, ensure_ascii=False)
    text = "" if value is None else str(value)
    return f"'{text}" if text.startswith(_FORMULA) else text

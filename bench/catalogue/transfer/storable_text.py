"""Texts as PostgreSQL can store them: without the character NUL."""

import re

from bench.catalogue.transfer.stored_tables import StoredRow

_REPLACEMENT = "\N{REPLACEMENT CHARACTER}"
_NUL_IN_JSON = re.compile(r"(?<!\\)((?:\\\\)*)\\u0000")
"""NUL in a text of JSON; after an escaped backslash, the same letters are text."""


def replace_nul(row: StoredRow, json_places: tuple[int, ...]) -> tuple[StoredRow, int]:
    """Return a row with NUL replaced in its texts and its JSON, and the number of changed values.

    The service replaces NUL in texts in the same way. In JSON the server accepts NUL, but fails as soon as a
    search reads it.
    """
    if not any(isinstance(value, str) and ("\0" in value or r"\u0000" in value) for value in row):
        return row, 0
    changed = tuple(
        _replace(value, is_json=place in json_places) if isinstance(value, str) else value
        for place, value in enumerate(row)
    )
    return changed, sum(old != new for old, new in zip(row, changed, strict=True))


def _replace(value: str, *, is_json: bool) -> str:
    if is_json:
        return _NUL_IN_JSON.sub(rf"\1{_REPLACEMENT}", value)
    return value.replace("\0", _REPLACEMENT)

"""Lines of an audit trail, read from its end, without reading the whole file."""

import json
import os
from collections.abc import Iterator

from pydantic import ValidationError

from bench.audit.entry import EMPTY_HEAD, AuditEntry, Head

_BLOCK = 1 << 16
"""Number of bytes that are read at once."""


def read_backwards(file: int, end: int) -> Iterator[bytes]:
    """Yield the lines before a position [bytes] from the last to the first, without their ends.

    The first one that is yielded is what follows the last end of a line: empty after a complete line.
    """
    rest: list[bytes] = []  # parts of one line, the last part first, so that a long line costs no repeated copies
    while end > 0:
        begin = max(0, end - _BLOCK)
        first, *others = os.pread(file, end - begin, begin).split(b"\n")
        end = begin
        if others:
            yield b"".join([others.pop(), *reversed(rest)])
            yield from reversed(others)
            rest = []
        rest.append(first)
    yield b"".join(reversed(rest))


def read_fragment(file: int, size: int) -> bytes:
    """Return what follows the last end of a line."""
    return next(read_backwards(file, size))


def find_last_entry(file: int, size: int) -> Head:
    """Return the last line that is an entry; a damaged one is passed over, and verification reports it."""
    lines = read_backwards(file, size)
    next(lines)
    found = (parse_entry(line) for line in lines)
    return next((entry.get_head() for entry in found if entry is not None), EMPTY_HEAD)


def parse_entry(line: bytes) -> AuditEntry | None:
    """Return the entry in a line; None if it is not one. Its hash is not checked."""
    try:
        return AuditEntry.model_validate(json.loads(line))
    except (ValueError, ValidationError, RecursionError):
        return None

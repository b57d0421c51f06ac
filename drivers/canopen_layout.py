"""How objects stand in process data frames, as plain data, so that a log can keep it for its replay."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import canopen

_LAST_SYNCHRONOUS = 240
"""Largest transmission type that answers SYNC."""


class Field(NamedTuple):
    """An object's place in a process data frame."""

    entry: int
    """Index of the object."""
    start: int
    """[bytes] from the beginning."""
    size: int
    """[bytes]"""
    signed: bool


class PdoLayout(NamedTuple):
    """A process data frame that the node sends or takes."""

    identifier: int
    size: int
    """[bytes]"""
    on_sync: bool
    """Sent in answer to each SYNC, or taken at one."""
    fields: tuple[Field, ...]

    def packed(self, values: Mapping[int, int]) -> bytes:
        """The frame's data from values by index; zero where none is given.

        Raises:
            OverflowError: a value does not fit its object.
        """
        data = bytearray(self.size)
        for entry, start, size, signed in self.fields:
            data[start : start + size] = values.get(entry, 0).to_bytes(size, "little", signed=signed)
        return bytes(data)


def layout_of(pdo: Any) -> PdoLayout:
    """What a mapping of the library says, as plain data."""
    signed = canopen.objectdictionary.SIGNED_TYPES
    fields = tuple(Field(v.index, v.offset // 8, v.length // 8, v.od.data_type in signed) for v in pdo)
    return PdoLayout(int(pdo.cob_id), pdo.length // 8, pdo.trans_type <= _LAST_SYNCHRONOUS, fields)

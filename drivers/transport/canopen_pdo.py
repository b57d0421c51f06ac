"""PDO mappings: objects in a process data frame as plain data, so that a log can store them for its replay."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import canopen

_MAX_SYNCHRONOUS_TYPE = 240
"""Largest synchronous transmission type (CiA 301): up to it, a frame belongs to a SYNC."""


class PdoField(NamedTuple):
    """One object in a process data frame."""

    object_index: int
    offset: int
    """[bytes] from the beginning of the frame."""
    size: int
    """[bytes]"""
    signed: bool


class PdoMapping(NamedTuple):
    """A process data frame that the node sends or receives."""

    identifier: int
    size: int
    """[bytes]"""
    on_sync: bool
    """True if the frame is sent, or takes effect, at each SYNC."""
    fields: tuple[PdoField, ...]

    def pack(self, values: Mapping[int, int]) -> bytes:
        """Return the frame's data from values by object index; zero for objects without a value.

        Raises:
            OverflowError: a value does not fit its object.
        """
        data = bytearray(self.size)
        for object_index, offset, size, signed in self.fields:
            data[offset : offset + size] = values.get(object_index, 0).to_bytes(size, "little", signed=signed)
        return bytes(data)


def read_mapping(pdo: Any) -> PdoMapping:
    """Convert a mapping of the canopen library to plain data."""
    signed = canopen.objectdictionary.SIGNED_TYPES
    fields = tuple(PdoField(v.index, v.offset // 8, v.length // 8, v.od.data_type in signed) for v in pdo)
    return PdoMapping(int(pdo.cob_id), pdo.length // 8, pdo.trans_type <= _MAX_SYNCHRONOUS_TYPE, fields)

"""A CANopen device's objects, as its EDS declares them: type, access, limits and present value.

The electronic data sheet is the contract with the bench, read here as data and by nobody else's code. Every object
is a plain variable under (index, sub-index); values are integers, or bytes for strings.
"""

import re
import struct
from configparser import RawConfigParser
from pathlib import Path
from typing import NamedTuple

ABORT_NO_OBJECT = 0x06020000
ABORT_NO_SUBINDEX = 0x06090011
ABORT_WRITE_ONLY = 0x06010001
ABORT_READ_ONLY = 0x06010002
ABORT_LENGTH = 0x06070010
ABORT_TOO_HIGH = 0x06090031
ABORT_TOO_LOW = 0x06090032
ABORT_COMMAND = 0x05040001
ABORT_TOGGLE = 0x05030000
"""Reasons of CiA 301 for an access that is broken off."""

_LAYOUTS = {0x02: "<b", 0x03: "<h", 0x04: "<i", 0x05: "<B", 0x06: "<H", 0x07: "<I"}
_SECTION = re.compile(r"^([0-9A-Fa-f]{4})(?:[Ss]ub([0-9A-Fa-f]+))?$")

Key = tuple[int, int]
Value = int | bytes


class Abort(Exception):  # noqa: N818 - the protocol's own word
    """An SDO request is refused with this code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"0x{code:08X}")
        self.code = code


class Entry(NamedTuple):
    """What the data sheet says of one object."""

    name: str
    layout: str | None
    """Of its bytes, as `struct` writes it; none for a string."""
    readable: bool
    writable: bool
    low: int | None
    high: int | None
    default: Value

    def encode(self, value: Value) -> bytes:
        """The bytes on the wire."""
        if self.layout is None:
            return value if isinstance(value, bytes) else b""
        return struct.pack(self.layout, value)

    def decode(self, data: bytes) -> Value:
        """The value in these bytes.

        Raises:
            Abort: they are too many or too few, or the value lies outside the object's limits.
        """
        if self.layout is None:
            return data
        if len(data) != struct.calcsize(self.layout):
            raise Abort(ABORT_LENGTH)
        value = int(struct.unpack(self.layout, data)[0])
        if self.low is not None and value < self.low:
            raise Abort(ABORT_TOO_LOW)
        if self.high is not None and value > self.high:
            raise Abort(ABORT_TOO_HIGH)
        return value


class ObjectDictionary:
    """The objects of one device and their present values."""

    def __init__(self, path: Path, node_id: int) -> None:
        self.entries = _entries(path, node_id)
        self._values = {key: entry.default for key, entry in self.entries.items()}

    def number(self, index: int, sub: int = 0) -> int:
        """Present value of a numeric object."""
        return int(self._values[index, sub])

    def put(self, index: int, value: int, sub: int = 0) -> None:
        """Set an object from inside the device, whatever its access."""
        self._values[index, sub] = value

    def upload(self, index: int, sub: int) -> bytes:
        """What a client reads.

        Raises:
            Abort: there is no such object, or it cannot be read.
        """
        entry = self._entry(index, sub)
        if not entry.readable:
            raise Abort(ABORT_WRITE_ONLY)
        return entry.encode(self._values[index, sub])

    def download(self, index: int, sub: int, data: bytes) -> None:
        """What a client writes.

        Raises:
            Abort: there is no such object, it cannot be written, or the value is none for it.
        """
        entry = self._entry(index, sub)
        if not entry.writable:
            raise Abort(ABORT_READ_ONLY)
        self._values[index, sub] = entry.decode(data)

    def _entry(self, index: int, sub: int) -> Entry:
        entry = self.entries.get((index, sub))
        if entry is None:
            known = any(known_index == index for known_index, _ in self.entries)
            raise Abort(ABORT_NO_SUBINDEX if known else ABORT_NO_OBJECT)
        return entry


def _entries(path: Path, node_id: int) -> dict[Key, Entry]:
    """Every variable of the data sheet."""
    sheet = RawConfigParser(inline_comment_prefixes=(";",))
    sheet.read_string(path.read_text(encoding="ascii"))
    found: dict[Key, Entry] = {}
    for name in sheet.sections():
        place = _SECTION.match(name)
        if place and sheet.has_option(name, "DataType"):
            key = int(place[1], 16), int(place[2] or "0", 16)
            found[key] = _entry_of(dict(sheet.items(name)), node_id)
    return found


def _entry_of(section: dict[str, str], node_id: int) -> Entry:
    """One variable; option names come in lower case."""
    layout = _LAYOUTS.get(int(section["datatype"], 0))
    access = section["accesstype"].lower()
    text = section.get("defaultvalue", "0")
    return Entry(
        name=section["parametername"],
        layout=layout,
        readable=access != "wo",
        writable="w" in access,
        low=_limit(section.get("lowlimit")),
        high=_limit(section.get("highlimit")),
        default=text.encode("ascii") if layout is None else _number(text, node_id),
    )


def _limit(text: str | None) -> int | None:
    return None if text is None else int(text, 0)


def _number(text: str, node_id: int) -> int:
    """A default such as ``$NODEID+0x200``."""
    return sum(node_id if part.strip().upper() == "$NODEID" else int(part, 0) for part in text.split("+"))

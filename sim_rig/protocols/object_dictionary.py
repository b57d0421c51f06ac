"""Object dictionary of a CANopen device, from its EDS: type, access, limits and present value of each object.

The electronic data sheet is the contract with the bench. It is read here as data, without the drivers' code. Every
object is a plain variable under (index, sub-index). Values are integers, or bytes for strings.
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
"""SDO abort codes of CiA 301."""

_LAYOUTS = {0x02: "<b", 0x03: "<h", 0x04: "<i", 0x05: "<B", 0x06: "<H", 0x07: "<I"}
_SECTION = re.compile(r"^([0-9A-Fa-f]{4})(?:[Ss]ub([0-9A-Fa-f]+))?$")

ObjectKey = tuple[int, int]
ObjectValue = int | bytes


class SdoAbortError(Exception):
    """An SDO request is refused with this code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"0x{code:08X}")
        self.code = code


class ObjectEntry(NamedTuple):
    """Declaration of one object in the data sheet."""

    name: str
    layout: str | None
    """Format of its bytes for `struct`; None for a string."""
    readable: bool
    writable: bool
    low: int | None
    high: int | None
    default: ObjectValue

    def encode(self, value: ObjectValue) -> bytes:
        """Return the bytes on the wire."""
        if self.layout is None:
            return value if isinstance(value, bytes) else b""
        return struct.pack(self.layout, value)

    def decode(self, data: bytes) -> ObjectValue:
        """Return the value of these bytes.

        Raises:
            SdoAbortError: wrong number of bytes, or a value outside the object's limits.
        """
        if self.layout is None:
            return data
        if len(data) != struct.calcsize(self.layout):
            raise SdoAbortError(ABORT_LENGTH)
        value = int(struct.unpack(self.layout, data)[0])
        if self.low is not None and value < self.low:
            raise SdoAbortError(ABORT_TOO_LOW)
        if self.high is not None and value > self.high:
            raise SdoAbortError(ABORT_TOO_HIGH)
        return value


class ObjectDictionary:
    """Objects of one device and their present values."""

    def __init__(self, path: Path, node_id: int) -> None:
        self.entries = _load_entries(path, node_id)
        self._values = {key: entry.default for key, entry in self.entries.items()}

    def get_number(self, index: int, sub: int = 0) -> int:
        """Return the present value of a numeric object."""
        return int(self._values[index, sub])

    def set_value(self, index: int, value: int, sub: int = 0) -> None:
        """Set an object from inside the device, regardless of its access rights."""
        self._values[index, sub] = value

    def upload(self, index: int, sub: int) -> bytes:
        """Return the bytes of an object for a client.

        Raises:
            SdoAbortError: there is no such object, or it cannot be read.
        """
        entry = self._find_entry(index, sub)
        if not entry.readable:
            raise SdoAbortError(ABORT_WRITE_ONLY)
        return entry.encode(self._values[index, sub])

    def download(self, index: int, sub: int, data: bytes) -> None:
        """Set an object from the bytes of a client.

        Raises:
            SdoAbortError: there is no such object, it cannot be written, or the value is invalid.
        """
        entry = self._find_entry(index, sub)
        if not entry.writable:
            raise SdoAbortError(ABORT_READ_ONLY)
        self._values[index, sub] = entry.decode(data)

    def _find_entry(self, index: int, sub: int) -> ObjectEntry:
        entry = self.entries.get((index, sub))
        if entry is None:
            known = any(known_index == index for known_index, _ in self.entries)
            raise SdoAbortError(ABORT_NO_SUBINDEX if known else ABORT_NO_OBJECT)
        return entry


def _load_entries(path: Path, node_id: int) -> dict[ObjectKey, ObjectEntry]:
    """Return every variable of the data sheet."""
    sheet = RawConfigParser(inline_comment_prefixes=(";",))
    sheet.read_string(path.read_text(encoding="ascii"))
    entries: dict[ObjectKey, ObjectEntry] = {}
    for name in sheet.sections():
        section = _SECTION.match(name)
        if section and sheet.has_option(name, "DataType"):
            key = int(section[1], 16), int(section[2] or "0", 16)
            entries[key] = _make_entry(dict(sheet.items(name)), node_id)
    return entries


def _make_entry(section: dict[str, str], node_id: int) -> ObjectEntry:
    """Return one variable; option names are in lower case."""
    layout = _LAYOUTS.get(int(section["datatype"], 0))
    access = section["accesstype"].lower()
    text = section.get("defaultvalue", "0")
    return ObjectEntry(
        name=section["parametername"],
        layout=layout,
        readable=access != "wo",
        writable="w" in access,
        low=_parse_limit(section.get("lowlimit")),
        high=_parse_limit(section.get("highlimit")),
        default=text.encode("ascii") if layout is None else _parse_number(text, node_id),
    )


def _parse_limit(text: str | None) -> int | None:
    return None if text is None else int(text, 0)


def _parse_number(text: str, node_id: int) -> int:
    """Return the number of a default such as ``$NODEID+0x200``."""
    return sum(node_id if part.strip().upper() == "$NODEID" else int(part, 0) for part in text.split("+"))

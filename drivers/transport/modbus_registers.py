"""Typed registers: a map that is data (``wire/*.toml``), and values in SI units read and written through it.

Numbers of two registers have the high word first or the low one, as the map states. The smallest signed number
means that there is no value, and is NaN here.
"""

import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

from drivers.channel import Access, Channel
from drivers.errors import OutOfRangeError
from drivers.transport.modbus_line import ModbusLine, RegisterReply, RegisterTable
from drivers.wire_files import load_wire_file

RegisterType = Literal["u16", "i16", "u32", "i32"]
WordOrder = Literal["high_first", "low_first"]
_FORMATS: dict[RegisterType, str] = {"u16": ">H", "i16": ">h", "u32": ">I", "i32": ">i"}


class RegisterValue(NamedTuple):
    """A value, and its number on the wire."""

    value: float
    """Value in the register's unit; NaN if the instrument has none."""
    raw: int


def count_words(type_: RegisterType) -> int:
    """Return the number of registers that a number takes."""
    return struct.calcsize(_FORMATS[type_]) // 2


def decode_number(words: Sequence[int], type_: RegisterType, order: WordOrder) -> int:
    """Return the number in as many words as its type takes."""
    ordered = words if order == "high_first" else list(reversed(words))
    (number,) = struct.unpack(_FORMATS[type_], struct.pack(f">{len(words)}H", *ordered))
    return int(number)


def encode_number(number: int, type_: RegisterType, order: WordOrder) -> list[int]:
    """Return the words of a number.

    Raises:
        OutOfRangeError: the number does not fit its type.
    """
    try:
        packed = struct.pack(_FORMATS[type_], number)
    except struct.error as error:
        raise OutOfRangeError(f"{number} does not fit a register of type {type_}; nothing was sent") from error
    words = list(struct.unpack(f">{count_words(type_)}H", packed))
    return words if order == "high_first" else words[::-1]


def scale_value(raw: int, type_: RegisterType, scale: float) -> float:
    """Return a number in its unit; NaN for the smallest one of a signed type."""
    if type_[0] == "i" and raw == -(2 ** (16 * count_words(type_) - 1)):
        return math.nan
    return raw * scale


@dataclass(frozen=True)
class Register:
    """One number of an instrument."""

    name: str
    address: int
    """Address of its first word."""
    type: RegisterType
    access: Access
    meaning: str
    scale: float = 1.0
    """Value of one step, in ``unit``."""
    unit: str = "1"
    low: float = -math.inf
    """Smallest value that may be written, in ``unit``."""
    high: float = math.inf
    """Largest value that may be written, in ``unit``."""

    @property
    def table(self) -> RegisterTable:
        """Table of the register: input if it can only be read, otherwise holding."""
        return "input" if self.access == "read" else "holding"

    @property
    def word_count(self) -> int:
        """Number of registers that the number takes."""
        return count_words(self.type)

    def make_channel(self) -> Channel:
        """Make a channel of the instrument with the register's name, unit and range."""
        return Channel(self.name, self.unit, self.low, self.high, self.access, self.meaning)


@dataclass(frozen=True)
class RegisterMap:
    """The contract with one kind of instrument."""

    instrument: str
    identity: int
    """Content of the register ``identity``."""
    unit: int
    """Unit number as shipped."""
    order: WordOrder
    registers: Mapping[str, Register]
    document: Mapping[str, Any]
    """The complete wire file, for its other sections."""


def load_register_map(instrument: str) -> RegisterMap:
    """Load the map in ``wire/INSTRUMENT.toml``."""
    document = load_wire_file(instrument)
    registers = {entry["name"]: Register(**entry) for entry in document["register"]}
    return RegisterMap(
        document["instrument"],
        document["identity"],
        document["unit"],
        document["word_order"],
        MappingProxyType(registers),
        MappingProxyType(document),
    )


class Registers:
    """An instrument's registers by name, over its line."""

    def __init__(self, line: ModbusLine, map_: RegisterMap) -> None:
        self.line = line
        self.map = map_

    def read(self, name: str) -> RegisterValue:
        """Read one value.

        Raises:
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: it was not read.
        """
        return self.read_group(name)[0][name]

    def read_group(self, *names: str) -> tuple[dict[str, RegisterValue], RegisterReply]:
        """Read several values of one instant in one request; their registers are adjacent.

        Raises:
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: they were not read.
        """
        registers = [self.map.registers[name] for name in names]
        start = min(register.address for register in registers)
        stop = max(register.address + register.word_count for register in registers)
        reply = self.line.read(registers[0].table, start, stop - start)
        values = {
            register.name: self._decode_register(register, reply.words[register.address - start :])
            for register in registers
        }
        return values, reply

    def _decode_register(self, register: Register, words: Sequence[int]) -> RegisterValue:
        raw = decode_number(words[: register.word_count], register.type, self.map.order)
        return RegisterValue(scale_value(raw, register.type, register.scale), raw)

    def write(self, name: str, value: float) -> None:
        """Write one value, rounded to the register's steps.

        Raises:
            OutOfRangeError: nothing was sent.
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: it was not confirmed.
        """
        self.line.write(*self._encode_value(name, value))

    def write_and_read(self, name: str, value: float, address: int, count: int) -> RegisterReply:
        """Write one value, then read holding registers, in one exchange.

        Raises:
            OutOfRangeError: nothing was sent.
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: no registers were read.
        """
        return self.line.write_and_read(*self._encode_value(name, value), address, count)

    def _encode_value(self, name: str, value: float) -> tuple[int, list[int]]:
        """Return address and words of a value."""
        register = self.map.registers[name]
        number = register.make_channel().validate(value) / register.scale
        return register.address, list(encode_number(round(number), register.type, self.map.order))

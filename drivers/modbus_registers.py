"""Typed registers: a map that is data, and values in SI read and written through it.

A map says what stands at which address (``wire/*.toml``). Numbers of two registers stand with the high word first,
or the low one, as the map says; a signed number at its least value says that there is no value, and is NaN here.
"""

import math
import struct
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

from drivers.channel import Access, Channel
from drivers.errors import OutOfRange
from drivers.modbus_line import Answer, ModbusLine, Table

Type = Literal["u16", "i16", "u32", "i32"]
WordOrder = Literal["high_first", "low_first"]
_FORMATS: dict[Type, str] = {"u16": ">H", "i16": ">h", "u32": ">I", "i32": ">i"}


class Quantity(NamedTuple):
    """A value, and what stood on the wire for it."""

    value: float
    """In the register's unit; NaN where the instrument says that it has none."""
    raw: int


def words_in(type_: Type) -> int:
    """How many registers a number takes."""
    return struct.calcsize(_FORMATS[type_]) // 2


def decode(words: Sequence[int], type_: Type, order: WordOrder) -> int:
    """The number that stands in as many words as its type takes."""
    ordered = words if order == "high_first" else list(reversed(words))
    (number,) = struct.unpack(_FORMATS[type_], struct.pack(f">{len(words)}H", *ordered))
    return int(number)


def encode(number: int, type_: Type, order: WordOrder) -> list[int]:
    """The words of a number.

    Raises:
        OutOfRange: its type cannot hold it.
    """
    try:
        packed = struct.pack(_FORMATS[type_], number)
    except struct.error as error:
        raise OutOfRange(f"{number} does not fit a register of type {type_}; nothing was sent") from error
    words = list(struct.unpack(f">{words_in(type_)}H", packed))
    return words if order == "high_first" else words[::-1]


def value_of(raw: int, type_: Type, scale: float) -> float:
    """A number in its unit; NaN for the least one of a signed type."""
    if type_[0] == "i" and raw == -(2 ** (16 * words_in(type_) - 1)):
        return math.nan
    return raw * scale


@dataclass(frozen=True)
class Register:
    """One number of an instrument."""

    name: str
    address: int
    """Of its first word."""
    type: Type
    access: Access
    meaning: str
    scale: float = 1.0
    """What one step is worth, in ``unit``."""
    unit: str = "1"
    low: float = -math.inf
    """Least value that may be written, in ``unit``."""
    high: float = math.inf
    """Largest value that may be written, in ``unit``."""

    @property
    def table(self) -> Table:
        """Where it stands: what can only be read is an input register."""
        return "input" if self.access == "read" else "holding"

    @property
    def words(self) -> int:
        """How many registers it takes."""
        return words_in(self.type)

    def channel(self) -> Channel:
        """As a channel of its instrument."""
        return Channel(self.name, self.unit, self.low, self.high, self.access, self.meaning)


@dataclass(frozen=True)
class RegisterMap:
    """The contract with one kind of instrument."""

    instrument: str
    identity: int
    """What its register ``identity`` reads."""
    unit: int
    """Its number on the wire as shipped."""
    order: WordOrder
    registers: Mapping[str, Register]
    document: Mapping[str, Any]
    """The whole wire file, for its other sections."""


def load_map(instrument: str) -> RegisterMap:
    """The map in ``wire/INSTRUMENT.toml``."""
    text = (Path(__file__).parent / "wire" / f"{instrument}.toml").read_text(encoding="utf-8")
    document = tomllib.loads(text)
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

    def read(self, name: str) -> Quantity:
        """One value now.

        Raises:
            NotConnected, NoReply, BadReply, Refused: it did not come.
        """
        return self.read_together(name)[0][name]

    def read_together(self, *names: str) -> tuple[dict[str, Quantity], Answer]:
        """Several values of one moment, in one request: registers that stand side by side.

        Raises:
            NotConnected, NoReply, BadReply, Refused: they did not come.
        """
        wanted = [self.map.registers[name] for name in names]
        start = min(register.address for register in wanted)
        stop = max(register.address + register.words for register in wanted)
        answer = self.line.read(wanted[0].table, start, stop - start)
        found = {
            register.name: self._quantity(register, answer.words[register.address - start :])
            for register in wanted
        }
        return found, answer

    def _quantity(self, register: Register, words: Sequence[int]) -> Quantity:
        raw = decode(words[: register.words], register.type, self.map.order)
        return Quantity(value_of(raw, register.type, register.scale), raw)

    def write(self, name: str, value: float) -> None:
        """Set one value, rounded to the register's steps.

        Raises:
            OutOfRange: nothing was sent.
            NotConnected, NoReply, BadReply, Refused: it was not confirmed.
        """
        self.line.write(*self._encoded(name, value))

    def write_and_read(self, name: str, value: float, address: int, count: int) -> Answer:
        """Set one value, then read holding registers, in one exchange.

        Raises:
            OutOfRange: nothing was sent.
            NotConnected, NoReply, BadReply, Refused: no registers came.
        """
        return self.line.write_and_read(*self._encoded(name, value), address, count)

    def _encoded(self, name: str, value: float) -> tuple[int, list[int]]:
        """Where a value goes, and its words."""
        register = self.map.registers[name]
        number = register.channel().checked(value) / register.scale
        return register.address, list(encode(round(number), register.type, self.map.order))

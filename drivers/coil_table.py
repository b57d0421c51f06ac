"""The coil amplifier's step table: times and levels that it runs by its own clock from a trigger on."""

from collections.abc import Callable
from enum import IntEnum
from typing import Any, Literal, NamedTuple

import numpy as np

from drivers.channel import Channel, Numbers
from drivers.errors import BadReply, OutOfRange
from drivers.modbus_registers import Registers, encode

_MOST_WRITTEN, _MOST_READ = 120, 120
"""Registers in one request, a whole number of steps."""


class TableState(IntEnum):
    """What the table is doing."""

    IDLE = 0
    ARMED = 1
    RUNNING = 2
    DONE = 3


class TableProgress(NamedTuple):
    """How far the table is."""

    state: TableState
    started_ns: int | None
    """The amplifier's own clock at the trigger [ns]; none before it."""


class StepTable:
    """The table of one amplifier."""

    def __init__(self, registers: Registers, drive: Channel) -> None:
        self._registers = registers
        self._drive = drive
        table: dict[str, Any] = registers.map.document["table"]
        self._address, self._capacity = int(table["address"]), int(table["capacity"])
        self._columns = table["columns"]
        self._commands: dict[str, int] = registers.map.document["codes"]["table_command"]

    @property
    def capacity(self) -> int:
        """Steps that it holds."""
        return self._capacity

    def upload(self, times: Numbers, levels: Numbers) -> None:
        """Write steps and read them back.

        Raises:
            OutOfRange: nothing was sent.
            NotConnected, NoReply, Refused: not confirmed.
            BadReply: something else stands in the table.
        """
        if len(times) != len(levels):
            raise OutOfRange(
                f"{self._registers.line.name}: {len(times)} times and {len(levels)} levels make no table; "
                "nothing was sent"
            )
        words = self._words(self._checked(times), [self._drive.checked(float(level)) for level in levels])
        line = self._registers.line
        for start in range(0, len(words), _MOST_WRITTEN):
            line.write(self._address + start, words[start : start + _MOST_WRITTEN])
        self._registers.write("table_length", len(times))
        # It will run with nobody looking: what went wrong on its way has to show now.
        for start in range(0, len(words), _MOST_READ):
            wanted = words[start : start + _MOST_READ]
            if line.read("holding", self._address + start, len(wanted)).words != wanted:
                raise BadReply(f"{line.name}: its step table does not read as written; upload it again")

    def command(self, what: Literal["abort", "arm"]) -> None:
        """Abort or arm it; what starts it is the trigger.

        Raises:
            NotConnected, NoReply, BadReply, Refused: not confirmed.
        """
        self._registers.write("table_command", self._commands[what])

    def progress(self, device_ns: Callable[[int], int] | None = None) -> TableProgress:
        """What it is doing; ``device_ns`` unwraps the amplifier's microseconds.

        Raises:
            NotConnected, NoReply, BadReply, Refused: it did not say.
        """
        found, _ = self._registers.read_together("table_state", "table_started")
        raw = found["table_state"].raw
        if raw not in set(TableState):
            name = self._registers.line.name
            raise BadReply(f"{name}: its step table is in state {raw}, which is none; see its wire file")
        state = TableState(raw)
        begun = state in {TableState.RUNNING, TableState.DONE} and device_ns is not None
        return TableProgress(state, device_ns(found["table_started"].raw) if begun and device_ns else None)

    def _checked(self, times: Numbers) -> Numbers:
        name = self._registers.line.name
        if not 1 <= len(times) <= self._capacity:
            raise OutOfRange(
                f"{name}: {len(times)} steps, its table holds 1 to {self._capacity}; nothing was sent"
            )
        longest = (2**32 - 1) * self._columns[0]["scale"]
        rising = bool(np.all(np.diff(times) >= self._columns[0]["scale"]))
        if not (rising and times[0] >= 0 and times[-1] <= longest):
            raise OutOfRange(
                f"{name}: step times must rise by at least 1 us each, from 0 to {longest:.0f} s; nothing was sent"
            )
        return times

    def _words(self, times: Numbers, levels: list[float]) -> list[int]:
        order = self._registers.map.order
        words: list[int] = []
        for step in zip(times, levels, strict=True):
            for column, value in zip(self._columns, step, strict=True):
                words += encode(round(float(value) / column["scale"]), column["type"], order)
        return words

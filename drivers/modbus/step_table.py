"""Step table of the coil amplifier: times and levels that it plays by its own clock from a trigger on."""

from collections.abc import Callable
from enum import IntEnum
from typing import Any, Literal, NamedTuple

import numpy as np

from drivers.channel import Array, Channel
from drivers.errors import InvalidReplyError, OutOfRangeError
from drivers.transport import Registers, encode_number

_MAX_WRITE_WORDS, _MAX_READ_WORDS = 120, 120
"""Registers in one request, a whole number of steps."""


class TableState(IntEnum):
    """State of the step table."""

    IDLE = 0
    ARMED = 1
    RUNNING = 2
    DONE = 3


class TableProgress(NamedTuple):
    """State of the step table, and the time of its trigger."""

    state: TableState
    started_ns: int | None
    """Device clock at the trigger [ns]; None before it."""


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
        """Largest number of steps."""
        return self._capacity

    def upload(self, times: Array, levels: Array) -> None:
        """Write steps and read them back.

        Raises:
            OutOfRangeError: nothing was sent.
            NotConnectedError, NoReplyError, RefusedError: the steps were not confirmed.
            InvalidReplyError: the table reads differently.
        """
        line = self._registers.line
        if len(times) != len(levels):
            raise OutOfRangeError(
                f"{line.name}: {len(times)} times and {len(levels)} levels do not match; nothing was sent"
            )
        self._check_times(times)
        words = self._encode_steps(times, [self._drive.validate(float(level)) for level in levels])
        for start in range(0, len(words), _MAX_WRITE_WORDS):
            line.write(self._address + start, words[start : start + _MAX_WRITE_WORDS])
        self._registers.write("table_length", len(times))
        # The table runs without supervision, so errors of the transfer are detected here.
        for start in range(0, len(words), _MAX_READ_WORDS):
            expected = words[start : start + _MAX_READ_WORDS]
            if line.read("holding", self._address + start, len(expected)).words != expected:
                raise InvalidReplyError(
                    f"{line.name}: its step table reads back other values than were written; upload it again"
                )

    def send_command(self, command: Literal["abort", "arm"]) -> None:
        """Abort or arm the table; the trigger starts it.

        Raises:
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: the command was not confirmed.
        """
        self._registers.write("table_command", self._commands[command])

    def read_progress(self, unwrap_clock: Callable[[int], int] | None = None) -> TableProgress:
        """Read the state of the table.

        Args:
            unwrap_clock: converts the amplifier's microseconds to its clock [ns]; without it the time of the
                trigger is not returned.

        Raises:
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: the state was not read.
        """
        values, _ = self._registers.read_group("table_state", "table_started")
        raw = values["table_state"].raw
        if raw not in set(TableState):
            name = self._registers.line.name
            raise InvalidReplyError(f"{name}: its step table reports unknown state {raw}; check its wire file")
        state = TableState(raw)
        has_started = state in {TableState.RUNNING, TableState.DONE}
        started_ns = unwrap_clock(values["table_started"].raw) if has_started and unwrap_clock else None
        return TableProgress(state, started_ns)

    def _check_times(self, times: Array) -> None:
        name, resolution = self._registers.line.name, self._columns[0]["scale"]
        if not 1 <= len(times) <= self._capacity:
            raise OutOfRangeError(
                f"{name}: {len(times)} steps, its table holds 1 to {self._capacity}; nothing was sent"
            )
        longest = (2**32 - 1) * resolution
        is_rising = bool(np.all(np.diff(times) >= resolution))
        if not (is_rising and times[0] >= 0 and times[-1] <= longest):
            raise OutOfRangeError(
                f"{name}: step times must rise by at least 1 us each, from 0 to {longest:.0f} s; nothing was sent"
            )

    def _encode_steps(self, times: Array, levels: list[float]) -> list[int]:
        order = self._registers.map.order
        words: list[int] = []
        for step in zip(times, levels, strict=True):
            for column, value in zip(self._columns, step, strict=True):
                words += encode_number(round(float(value) / column["scale"]), column["type"], order)
        return words

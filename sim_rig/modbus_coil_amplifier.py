"""The simulated coil amplifier: drives the coil, measures there, and watches its wire, on Modbus.

Its output is a function of the rig's time (`sim_rig.coil_output`). Whenever it is looked at, by a request, by its
server, or by the rig with every sample, it tells the rig where the output stands. When nobody has spoken for the
time of its watchdog, the output ramps to zero from the moment at which the time was up.
"""

import itertools
import threading
from typing import Any, Literal

from sim_rig.coil_output import CoilOutput, Table
from sim_rig.device_clock import TRUE_CLOCK, DeviceClock
from sim_rig.modbus_device import (
    RegisterBank,
    SampleRing,
    Section,
    from_words,
    size_of,
    wire_file,
)
from sim_rig.modbus_requests import Illegal
from sim_rig.signals import Signals

FaultName = Literal["over_temperature", "open_coil", "over_current"]
_VALUE, _STATE = 3, 4


class CoilAmplifierDevice:
    """What its registers mean; knows no socket."""

    def __init__(
        self, signals: Signals, clock: DeviceClock = TRUE_CLOCK, drive_unit: Literal["V", "A"] = "V"
    ) -> None:
        """Begin with the output off.

        Args:
            signals: the rig's coil, and where the drive goes.
            clock: its own.
            drive_unit: whether the rig's damper is driven by voltage or by current; the other mode is refused.
        """
        self._document = wire_file("coil_amplifier")
        self._signals, self._clock = signals, clock
        kind = "voltage" if drive_unit == "V" else "current"
        self._codes: dict[str, dict[str, int]] = self._document["codes"]
        self._mode_on, self._limit = self._codes["mode"][kind], float(self._document["limits"][kind])
        self.ring = SampleRing(self._document, signals, clock, self._status)
        self.output = CoilOutput()
        self.tripped = False
        self._lock = threading.RLock()
        self._mode = self._fault = self._cause = self._table_length = 0
        self._watchdog, self._heard_ns = 0.5, signals.now_ns()
        self._told: float | None = None
        columns = self._document["table"]["columns"]
        self._step_words = sum(size_of(column["type"]) for column in columns)
        self._table = [0] * (self._document["table"]["capacity"] * self._step_words)
        self._bank = RegisterBank(self._document, self._getters(), self._putters(), self._sections())

    def read(self, function: int, address: int, count: int) -> list[int]:
        """Words of its registers.

        Raises:
            Illegal: they do not exist.
        """
        with self._lock:
            self._heard()
            return self._bank.read(function, address, count)

    def write(self, address: int, words: list[int]) -> None:
        """Set its registers.

        Raises:
            Illegal: they do not exist, or do not take it now.
        """
        with self._lock:
            self._heard()
            self._bank.write(address, words)
            self.advance()

    def advance(self) -> float:
        """Let time have passed: tell the rig where the output stands [V or A], and return it."""
        with self._lock:
            now = self._signals.now_ns()
            self._watch(now)
            level = self.output.level(now)
            if level != self._told:
                self._told = level
                self._signals.command("drive", level)
            return level

    def trigger(self, at_ns: int) -> None:
        """The SYNC input has moved, at ``at_ns`` [ns]: an armed table starts then."""
        with self._lock:
            self.output.trigger(at_ns)
            self.advance()

    def fail(self, fault: FaultName) -> None:
        """Let the cause of a fault appear: the output goes to zero at once."""
        with self._lock:
            self._cause |= self._codes["fault"][fault]
            self._fault |= self._cause
            self.output.cut(self._signals.now_ns())
            self.advance()

    def heal(self) -> None:
        """Let the causes of all faults go; the faults stay until they are reset."""
        with self._lock:
            self._cause = 0

    def restart(self) -> None:
        """It has been switched off and on: settings, table and numbers are gone."""
        with self._lock:
            self.output.cut(self._signals.now_ns())
            self._mode, self._fault, self.tripped, self._table_length = 0, self._cause, False, 0
            self.ring.restart()
            self.advance()

    def _heard(self) -> None:
        self.advance()  # first what the silence before has done
        self._heard_ns = self._signals.now_ns()

    def _watch(self, now: int) -> None:
        up = self._heard_ns + round(self._watchdog * 1e9)
        output = self.output
        if self.tripped or now < up:
            return
        # An armed table, too: it would start while nobody is there to stop it.
        if output.level(up) or output.target or output.table in {Table.ARMED, Table.RUNNING}:
            self.tripped = True
            output.abort(up)
            output.go(0.0, up)

    def _status(self) -> int:
        return self._fault | self._state() << 8

    def _state(self) -> int:
        level, codes = self.output.level(self._signals.now_ns()), self._codes["state"]
        on = codes["output_on"] if self._mode else 0
        ramping = codes["ramping"] if level != self.output.target else 0
        return on | ramping | (codes["watchdog_tripped"] if self.tripped else 0)

    def _getters(self) -> dict[str, Any]:
        return {
            **self.ring.registers(),
            "fault": lambda: self._fault,
            "state": self._state,
            "output": lambda: self.output.level(self._signals.now_ns()),
            "table_state": self._table_state,
            "table_started": lambda: self.ring.microseconds(self.output.started_ns) * 1e-6,
            "mode": lambda: self._mode,
            "setpoint": lambda: self.output.target,
            "ramp": lambda: self.output.ramp,
            "watchdog": lambda: self._watchdog,
            "reset": lambda: 0,
            "table_length": lambda: self._table_length,
            "table_command": lambda: 0,
        }

    def _putters(self) -> dict[str, Any]:
        return {
            "wanted": self.ring.want,
            "mode": self._set_mode,
            "setpoint": self._set_setpoint,
            "ramp": self._set_ramp,
            "watchdog": self._set_watchdog,
            "reset": self._reset,
            "table_length": self._set_table_length,
            "table_command": self._command_table,
        }

    def _sections(self) -> list[Section]:
        address, length = self._document["table"]["address"], len(self._table)
        return [self.ring.section(), Section((3,), address, length, lambda: self._table, self._write_table)]

    def _table_state(self) -> int:
        self.output.settle(self._signals.now_ns())
        return int(self.output.table)

    def _set_mode(self, value: float) -> None:
        if value not in {0, self._mode_on}:
            raise Illegal(_VALUE)
        if self.output.level(self._signals.now_ns()):
            raise Illegal(_STATE)
        self._mode = int(value)

    def _set_setpoint(self, value: float) -> None:
        if abs(value) > self._limit:
            raise Illegal(_VALUE)
        unable = not self._mode or self._fault or self.tripped
        if (value and unable) or self.output.table is Table.RUNNING:
            raise Illegal(_STATE)
        self.output.go(value, self._signals.now_ns())

    def _set_ramp(self, value: float) -> None:
        now, target = self._signals.now_ns(), self.output.target
        # From where it is now: the new slope is none of the way behind it.
        if self.output.table is not Table.RUNNING:
            self.output.go(target, now)
        self.output.ramp = value

    def _set_watchdog(self, value: float) -> None:
        self._watchdog = value

    def _reset(self, value: float) -> None:
        if value != 1:
            raise Illegal(_VALUE)
        if self._fault or self.tripped:
            self.output.go(0.0, self._signals.now_ns())
        self._fault, self.tripped = self._cause, False

    def _set_table_length(self, value: float) -> None:
        self._refuse_while_running()
        if not 1 <= value <= self._document["table"]["capacity"]:
            raise Illegal(_VALUE)
        self._table_length = int(value)

    def _write_table(self, offset: int, words: list[int]) -> None:
        self._refuse_while_running()
        self._table[offset : offset + len(words)] = words

    def _refuse_while_running(self) -> None:
        if self._table_state() in {Table.ARMED, Table.RUNNING}:
            raise Illegal(_STATE)

    def _command_table(self, value: float) -> None:
        now, commands = self._signals.now_ns(), self._codes["table_command"]
        if value == commands["abort"]:
            self.output.abort(now)
        elif value == commands["arm"]:
            if not self._mode or self._fault or self.tripped or self._table_state() == Table.RUNNING:
                raise Illegal(_STATE)
            self.output.arm(self._checked_steps())
        else:
            raise Illegal(_VALUE)

    def _checked_steps(self) -> list[tuple[int, float]]:
        """The table as times on the rig's clock [ns] and levels."""
        columns, low_first = self._document["table"]["columns"], self._document["word_order"] == "low_first"
        half = size_of(columns[0]["type"])
        steps = []
        for place in range(0, self._table_length * self._step_words, self._step_words):
            words = self._table[place : place + self._step_words]
            own, level = (
                from_words(part, column["type"], column["scale"], low_first)
                for part, column in zip((words[:half], words[half:]), columns, strict=True)
            )
            # Its times are its own clock's, which is some ppm off the rig's.
            steps.append((round(own * 1e9 / (1 + self._clock.ppm * 1e-6)), level))
        rising = all(before[0] < after[0] for before, after in itertools.pairwise(steps))
        if not (steps and rising and all(abs(level) <= self._limit for _, level in steps)):
            raise Illegal(_VALUE)
        return steps

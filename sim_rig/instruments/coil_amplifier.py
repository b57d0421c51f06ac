"""Simulated coil amplifier on Modbus: it drives the coil, measures there, and has a watchdog for requests.

Its output is a function of the rig's time (`sim_rig.instruments.coil_output`). It reports the output to the rig at
every request, every tick of its server and every sample of the rig. Without a request for the watchdog time, the
output ramps to zero from the instant at which that time ended.
"""

import itertools
import threading
from typing import Any, Literal

from sim_rig.instruments.coil_output import CoilOutput, TableState
from sim_rig.instruments.modbus_registers import (
    RegisterBank,
    RegisterSection,
    SampleRingBuffer,
    count_words,
    decode_words,
)
from sim_rig.instruments.wire_files import load_wire_file
from sim_rig.live import TRUE_CLOCK, DeviceClock, RigInterface
from sim_rig.protocols import ModbusRequestError

FaultName = Literal["over_temperature", "open_coil", "over_current"]
_ILLEGAL_VALUE, _ILLEGAL_STATE = 3, 4


class CoilAmplifierDevice:
    """Registers of the amplifier, without its wire."""

    def __init__(
        self, signals: RigInterface, clock: DeviceClock = TRUE_CLOCK, drive_unit: Literal["V", "A"] = "V"
    ) -> None:
        """Switch the amplifier on with its output off.

        Args:
            signals: the rig.
            clock: the amplifier's clock.
            drive_unit: whether the rig's damper is driven by voltage or by current; the other mode is refused.
        """
        self._document = load_wire_file("coil_amplifier")
        self._signals, self._clock = signals, clock
        kind = "voltage" if drive_unit == "V" else "current"
        self._codes: dict[str, dict[str, int]] = self._document["codes"]
        self._active_mode, self._limit = self._codes["mode"][kind], float(self._document["limits"][kind])
        self.ring_buffer = SampleRingBuffer(self._document, signals, clock, self._get_status)
        self.output = CoilOutput()
        self.tripped = False
        self._lock = threading.RLock()
        self._mode = self._fault = self._cause = self._table_length = 0
        self._watchdog, self._last_request_ns = 0.5, signals.now_ns()
        self._reported_level: float | None = None
        columns = self._document["table"]["columns"]
        self._step_words = sum(count_words(column["type"]) for column in columns)
        self._table = [0] * (self._document["table"]["capacity"] * self._step_words)
        self._bank = RegisterBank(
            self._document, self._make_getters(), self._make_setters(), self._make_sections()
        )

    def read(self, function: int, address: int, count: int) -> list[int]:
        """Return words of its registers.

        Raises:
            ModbusRequestError: they do not exist.
        """
        with self._lock:
            self._record_request()
            return self._bank.read(function, address, count)

    def write(self, address: int, words: list[int]) -> None:
        """Set its registers.

        Raises:
            ModbusRequestError: they do not exist, or cannot be set now.
        """
        with self._lock:
            self._record_request()
            self._bank.write(address, words)
            self.advance()

    def advance(self) -> float:
        """Advance to the present instant: report the output [V or A] to the rig, and return it."""
        with self._lock:
            now = self._signals.now_ns()
            self._check_watchdog(now)
            level = self.output.compute_level(now)
            if level != self._reported_level:
                self._reported_level = level
                self._signals.command("drive", level)
            return level

    def follow_time(self) -> bool:
        """Advance to the present instant; return whether the output changes by itself, or soon may."""
        with self._lock:
            changes = self.advance() != self.output.target or self.output.table is TableState.RUNNING
            silence_ns = self._signals.now_ns() - self._last_request_ns
            return changes or silence_ns > self._watchdog * 1e9 / 2

    def trigger(self, at_ns: int) -> None:
        """Start an armed table by a pulse of the SYNC input at ``at_ns`` [ns]."""
        with self._lock:
            self.output.trigger(at_ns)
            self.advance()

    def inject_fault(self, fault: FaultName) -> None:
        """Set the cause of a fault: the output goes to zero at once."""
        with self._lock:
            self._cause |= self._codes["fault"][fault]
            self._fault |= self._cause
            self.output.set_zero(self._signals.now_ns())
            self.advance()

    def remove_fault_causes(self) -> None:
        """Remove the causes of all faults; the faults stay until they are reset."""
        with self._lock:
            self._cause = 0

    def restart(self) -> None:
        """Switch the amplifier off and on: settings, table and sample numbers are lost."""
        with self._lock:
            self.output.set_zero(self._signals.now_ns())
            self._mode, self._fault, self.tripped, self._table_length = 0, self._cause, False, 0
            self.ring_buffer.restart()
            self.advance()

    def _record_request(self) -> None:
        self.advance()  # first, as the watchdog may have expired before this request
        self._last_request_ns = self._signals.now_ns()

    def _check_watchdog(self, now: int) -> None:
        expiry = self._last_request_ns + round(self._watchdog * 1e9)
        output = self.output
        if self.tripped or now < expiry:
            return
        # An armed table counts as well: without a host it could start and not be stopped.
        if output.compute_level(expiry) or output.target or output.table in {TableState.ARMED, TableState.RUNNING}:
            self.tripped = True
            output.abort(expiry)
            output.set_target(0.0, expiry)

    def _get_status(self) -> int:
        return self._fault | self._get_state() << 8

    def _get_state(self) -> int:
        level, codes = self.output.compute_level(self._signals.now_ns()), self._codes["state"]
        on = codes["output_on"] if self._mode else 0
        ramping = codes["ramping"] if level != self.output.target else 0
        return on | ramping | (codes["watchdog_tripped"] if self.tripped else 0)

    def _make_getters(self) -> dict[str, Any]:
        return {
            **self.ring_buffer.make_getters(),
            "fault": lambda: self._fault,
            "state": self._get_state,
            "output": lambda: self.output.compute_level(self._signals.now_ns()),
            "table_state": self._get_table_state,
            "table_started": lambda: self.ring_buffer.read_clock_us(self.output.started_ns) * 1e-6,
            "mode": lambda: self._mode,
            "setpoint": lambda: self.output.target,
            "ramp": lambda: self.output.ramp,
            "watchdog": lambda: self._watchdog,
            "reset": lambda: 0,
            "table_length": lambda: self._table_length,
            "table_command": lambda: 0,
        }

    def _make_setters(self) -> dict[str, Any]:
        return {
            "block_start": self.ring_buffer.set_start,
            "mode": self._set_mode,
            "setpoint": self._set_setpoint,
            "ramp": self._set_ramp,
            "watchdog": self._set_watchdog,
            "reset": self._reset,
            "table_length": self._set_table_length,
            "table_command": self._command_table,
        }

    def _make_sections(self) -> list[RegisterSection]:
        address, length = self._document["table"]["address"], len(self._table)
        return [
            self.ring_buffer.make_section(),
            RegisterSection((3,), address, length, lambda: self._table, self._write_table),
        ]

    def _get_table_state(self) -> int:
        self.output.update(self._signals.now_ns())
        return int(self.output.table)

    def _set_mode(self, value: float) -> None:
        if value not in {0, self._active_mode}:
            raise ModbusRequestError(_ILLEGAL_VALUE)
        if self.output.compute_level(self._signals.now_ns()):
            raise ModbusRequestError(_ILLEGAL_STATE)
        self._mode = int(value)

    def _set_setpoint(self, value: float) -> None:
        if abs(value) > self._limit:
            raise ModbusRequestError(_ILLEGAL_VALUE)
        blocked = not self._mode or self._fault or self.tripped
        if (value and blocked) or self.output.table is TableState.RUNNING:
            raise ModbusRequestError(_ILLEGAL_STATE)
        self.output.set_target(value, self._signals.now_ns())

    def _set_ramp(self, value: float) -> None:
        now, target = self._signals.now_ns(), self.output.target
        # From the present level, as the new slope does not apply to the past.
        if self.output.table is not TableState.RUNNING:
            self.output.set_target(target, now)
        self.output.ramp = value

    def _set_watchdog(self, value: float) -> None:
        self._watchdog = value

    def _reset(self, value: float) -> None:
        if value != 1:
            raise ModbusRequestError(_ILLEGAL_VALUE)
        if self._fault or self.tripped:
            self.output.set_target(0.0, self._signals.now_ns())
        self._fault, self.tripped = self._cause, False

    def _set_table_length(self, value: float) -> None:
        self._refuse_while_running()
        if not 1 <= value <= self._document["table"]["capacity"]:
            raise ModbusRequestError(_ILLEGAL_VALUE)
        self._table_length = int(value)

    def _write_table(self, offset: int, words: list[int]) -> None:
        self._refuse_while_running()
        self._table[offset : offset + len(words)] = words

    def _refuse_while_running(self) -> None:
        if self._get_table_state() in {TableState.ARMED, TableState.RUNNING}:
            raise ModbusRequestError(_ILLEGAL_STATE)

    def _command_table(self, value: float) -> None:
        now, commands = self._signals.now_ns(), self._codes["table_command"]
        if value == commands["abort"]:
            self.output.abort(now)
        elif value == commands["arm"]:
            if not self._mode or self._fault or self.tripped or self._get_table_state() == TableState.RUNNING:
                raise ModbusRequestError(_ILLEGAL_STATE)
            self.output.arm(self._decode_steps())
        else:
            raise ModbusRequestError(_ILLEGAL_VALUE)

    def _decode_steps(self) -> list[tuple[int, float]]:
        """Return the table as times on the rig's clock [ns] and levels."""
        columns, low_first = self._document["table"]["columns"], self._document["word_order"] == "low_first"
        half = count_words(columns[0]["type"])
        steps = []
        for start in range(0, self._table_length * self._step_words, self._step_words):
            words = self._table[start : start + self._step_words]
            device_time, level = (
                decode_words(part, column["type"], column["scale"], low_first)
                for part, column in zip((words[:half], words[half:]), columns, strict=True)
            )
            # The times are on the amplifier's clock, which deviates by some ppm from the rig's.
            steps.append((round(device_time * 1e9 / (1 + self._clock.ppm * 1e-6)), level))
        increasing = all(before[0] < after[0] for before, after in itertools.pairwise(steps))
        if not (steps and increasing and all(abs(level) <= self._limit for _, level in steps)):
            raise ModbusRequestError(_ILLEGAL_VALUE)
        return steps

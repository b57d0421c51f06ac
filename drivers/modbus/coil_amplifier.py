"""Coil amplifier over Modbus: drives the damper's coil, and measures its voltage and current.

The output follows its setpoint by a ramp. Setpoints over a polled bus are late by as much as the time constant of
the coil. Steps with exact times are therefore uploaded as a table, read back and armed, and the amplifier plays
them by its own clock from its trigger on. A watchdog in the amplifier ramps the output to zero when no request has
arrived for a while. `make_safe` is faster, but never the only protection.
"""

import contextlib
import time
from dataclasses import replace
from enum import IntEnum, IntFlag
from typing import Literal, NamedTuple

from drivers.channel import Array, Channel, Reading
from drivers.errors import DriverError, OutOfRangeError, RefusedError
from drivers.instrument import Clock, Health
from drivers.modbus.instrument import ModbusInstrument
from drivers.modbus.step_table import StepTable, TableProgress
from drivers.transport import ModbusAddress

DriveMode = Literal["voltage", "current"]
DRIVE_UNITS: dict[DriveMode, str] = {"voltage": "V", "current": "A"}
_RAMP_TIMEOUT = 3.0
"""Time that `CoilAmplifier.connect` waits for an output that another host has left on [s]."""
_SAFE_TIMEOUT = 0.5
"""Time that `CoilAmplifier.make_safe` waits for zero output [s]."""


class CoilMode(IntEnum):
    """Quantity that the amplifier holds at its setpoint."""

    OFF = 0
    VOLTAGE = 1
    CURRENT = 2


class CoilFault(IntFlag):
    """Fault that has switched the output to zero until a reset."""

    NONE = 0
    OVER_TEMPERATURE = 1
    OPEN_COIL = 2
    OVER_CURRENT = 4


_KNOWN_FAULTS = sum(CoilFault)


class CoilState(IntFlag):
    """State of the output."""

    IDLE = 0
    OUTPUT_ON = 1
    RAMPING = 2
    WATCHDOG_TRIPPED = 4


class AmplifierStatus(NamedTuple):
    """Fault, state and output of the amplifier, read together."""

    fault: CoilFault
    state: CoilState
    output: float
    """Present setting of the output, ramp and table included [V or A]."""

    @property
    def message(self) -> str:
        """Description of the faults; empty without a fault."""
        names = [fault.name or "" for fault in self.fault]
        if unknown := int(self.fault) & ~_KNOWN_FAULTS:
            names.append(f"fault {unknown:02X}h, see the amplifier's manual")
        if self.state & CoilState.WATCHDOG_TRIPPED:
            names.append("watchdog tripped: no request for too long")
        return ", ".join(name.lower().replace("_", " ") for name in names)


class CoilAmplifier(ModbusInstrument):
    """One amplifier on its wire."""

    def __init__(
        self,
        name: str,
        address: ModbusAddress,
        clock: Clock,
        *,
        mode: DriveMode = "voltage",
        ramp: float = 100.0,
        watchdog: float = 0.5,
        unit: int | None = None,
        timeout: float = 0.2,
    ) -> None:
        """Prepare; nothing is opened yet.

        Args:
            name: used in configuration, logs and messages.
            address: address of the line; without a baud rate, that of the wire file is used.
            clock: bench clock [ns].
            mode: whether it holds voltage or current, which sets the unit of the drive, V or A.
            ramp: [V/s or A/s] towards a new setpoint and, after the watchdog, to zero.
            watchdog: [s] without a request after which it ramps to zero, 0.05 to 10.
            unit: Modbus unit number; by default that of the wire file.
            timeout: [s] without a reply after which a request has failed.

        Raises:
            OutOfRangeError: the serial line is too slow for its samples, or a setting is out of its range.
        """
        super().__init__(name, "coil_amplifier", address, clock, unit, timeout)
        registers = self._registers.map.registers
        self._mode: DriveMode = mode
        self._settings = {
            "ramp": registers["ramp"].make_channel().validate(ramp),
            "watchdog": registers["watchdog"].make_channel().validate(watchdog),
        }
        limit = float(self._registers.map.document["limits"][mode])
        drive = replace(registers["setpoint"], low=-limit, high=limit).make_channel()
        self._drive = replace(drive, name="coil_drive", unit=DRIVE_UNITS[mode])
        self._table = StepTable(self._registers, self._drive)
        self._safe_state_message = ""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Voltage and current as measured, and the commanded drive."""
        return (*super().channels, self._drive)

    @property
    def faults(self) -> CoilFault:
        """Faults in the latest block; `read_status` requests them now."""
        return CoilFault(self._reader.status & 0xFF)

    @property
    def state(self) -> CoilState:
        """State in the latest block; `read_status` requests it now."""
        return CoilState(self._reader.status >> 8)

    def connect(self) -> None:
        """Open the line, check the identity, bring the output to zero, set mode, ramp and watchdog.

        Raises:
            NotConnectedError: the line cannot be opened.
            NoReplyError, InvalidReplyError: no coil amplifier replies.
            RefusedError: a fault remains, or the amplifier refuses a setting.
        """
        super().connect()
        try:
            self._configure()
        except DriverError:
            super().close()
            raise

    def close(self) -> None:
        """Bring the output to zero if the line is open, and close the line."""
        if self._line.connected:
            self.make_safe()
        super().close()

    def read(self, channel: str) -> Reading:
        """Request the latest measured sample, or for ``coil_drive`` the present setting of the output.

        Raises:
            OutOfRangeError: there is no such channel.
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: the value was not read.
        """
        if channel != self._drive.name:
            return super().read(channel)
        values, reply = self._registers.read_group("output")
        value, raw = values["output"]
        return Reading(value, reply.received_ns, None, raw, "good")

    def write(self, channel: str, value: float) -> None:
        """Set the drive; the output follows by the ramp.

        Raises:
            OutOfRangeError: the value is too large, or the channel is not the drive; nothing was sent.
            NotConnectedError, NoReplyError, InvalidReplyError: the setpoint was not confirmed.
            RefusedError: a fault, the watchdog or a running table forbids it; the message names it.
        """
        if channel != self._drive.name:
            raise OutOfRangeError(f"{self.name}: {channel} is measured and cannot be set; coil_drive can")
        try:
            self._registers.write("setpoint", self._drive.validate(value))
        except RefusedError as error:
            reason = self.read_status().message or f"its table is {self._table.read_progress().state.name.lower()}"
            raise RefusedError(f"{error}; {reason}; reset it, or abort the table") from error

    def read_status(self) -> AmplifierStatus:
        """Request fault, state and output.

        Raises:
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: the status was not read.
        """
        values, _ = self._registers.read_group("fault", "state", "output")
        fault, state = CoilFault(values["fault"].raw), CoilState(values["state"].raw)
        return AmplifierStatus(fault, state, values["output"].value)

    def reset(self) -> None:
        """Clear the tripped watchdog, and faults whose cause is gone; the output stays at zero.

        Raises:
            NotConnectedError, NoReplyError, InvalidReplyError: the reset was not confirmed.
            RefusedError: a fault remains.
        """
        self._registers.write("reset", 1)
        if message := self.read_status().message:
            raise RefusedError(f"{self.name}: the fault remains after a reset: {message}; find the cause")

    @property
    def table_capacity(self) -> int:
        """Largest number of steps in its table."""
        return self._table.capacity

    def upload_table(self, times: Array, levels: Array) -> None:
        """Write steps into the table and read them back; the output does not change yet.

        Args:
            times: (steps,) [s] after the trigger, rising from 0 or later.
            levels: (steps,) of the drive [V or A], each from its time on; the last one stays.

        Raises:
            OutOfRangeError: too many steps, times that do not rise, or a level too large; nothing was sent.
            NotConnectedError, NoReplyError, RefusedError: the steps were not confirmed.
            InvalidReplyError: the table reads differently.
        """
        self._table.upload(times, levels)

    def arm_table(self) -> None:
        """Let the table start with the next trigger (the SYNC input).

        Raises:
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: the table is not armed.
        """
        self._table.send_command("arm")

    def abort_table(self) -> None:
        """Stop the table; the output keeps its level.

        Raises:
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: the stop was not confirmed.
        """
        self._table.send_command("abort")

    def read_table_progress(self) -> TableProgress:
        """Request the state of the table and the time of its trigger.

        Raises:
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: the state was not read.
        """
        return self._table.read_progress(self._reader.unwrap_clock)

    def make_safe(self) -> str:
        """Bring the output to zero by its ramp, and wait until it is zero or the deadline is over.

        If the line is dead, the amplifier's watchdog does it.

        Returns:
            The reason why the amplifier did not confirm zero output; empty if it did.
        """
        reason = self.ramp_down()
        try:
            # Also after a refused command, because a fault or the watchdog has switched the output off.
            self._wait_for_zero(_SAFE_TIMEOUT)
        except DriverError as error:
            return self._note_safe_state(reason or str(error))
        return self._note_safe_state("")

    def ramp_down(self) -> str:
        """Command zero output without waiting for it; raises nothing, even if the wire is gone.

        Returns:
            The reason why the amplifier did not accept the command; empty if it did.
        """
        reason = ""
        # Twice: after a lost reply, the next request reopens or synchronises the line.
        for _ in range(2):
            try:
                # A refusal, because there is nothing to abort, must not leave the output on.
                with contextlib.suppress(RefusedError):
                    self.abort_table()
                self._registers.write("setpoint", 0.0)
            except DriverError as error:
                reason = str(error)
                continue
            return self._note_safe_state("")
        return self._note_safe_state(reason)

    def get_health(self) -> Health:
        """Return counts and state, faults included."""
        health = super().get_health()
        message = health.message or AmplifierStatus(self.faults, self.state, 0.0).message
        return replace(health, message="; ".join(filter(None, [self._safe_state_message, message])))

    def _note_safe_state(self, reason: str) -> str:
        """Keep the reason why zero output is not confirmed for `get_health`, and return it."""
        self._safe_state_message = f"zero output not confirmed: {reason}" if reason else ""
        return reason

    def _wait_for_zero(self, timeout: float) -> None:
        deadline = time.monotonic() + timeout
        while (output := self.read_status().output) != 0.0:
            if time.monotonic() > deadline:
                raise RefusedError(
                    f"{self.name}: the output is still at {output:.4g} {self._drive.unit} after "
                    f"{timeout:g} s of waiting for zero; set a steeper ramp"
                )
            time.sleep(0.01)

    def _configure(self) -> None:
        registers = self._registers
        # The order matters: a running table, a fault or an output other than zero makes it refuse what follows.
        self.abort_table()
        self.reset()
        registers.write("setpoint", 0.0)
        self._wait_for_zero(_RAMP_TIMEOUT)
        for name, value in self._settings.items():
            registers.write(name, value)
        mode = CoilMode[self._mode.upper()]
        if registers.read("mode").raw != mode:
            registers.write("mode", mode)

"""Coil amplifier over Modbus: what drives the damper's coil, and what it measures there.

The output goes to its setpoint by a ramp. Steps that must be exact are not sent one by one, since a polled bus is
as late as the coil itself is slow: a table of times and levels is uploaded, read back, armed, and run by the
amplifier's own clock from its trigger on. The amplifier watches its wire: when nobody has spoken for a while it
ramps its output to zero by itself. `make_safe` is the faster way there, never the only one.
"""

import contextlib
import time
from dataclasses import replace
from enum import IntEnum, IntFlag
from typing import Literal, NamedTuple

from drivers.channel import Channel, Numbers, Reading
from drivers.coil_table import StepTable, TableProgress
from drivers.errors import DriverError, OutOfRange, Refused
from drivers.instrument import Clock, Health
from drivers.modbus_address import ModbusAddress
from drivers.modbus_instrument import ModbusInstrument

Mode = Literal["voltage", "current"]
_LONGEST_RAMP = 3.0
"""[s] that connecting waits for an output that another host has left on."""
DRIVE_UNITS: dict[Mode, str] = {"voltage": "V", "current": "A"}


class CoilMode(IntEnum):
    """What the amplifier holds at its setpoint."""

    OFF = 0
    VOLTAGE = 1
    CURRENT = 2


class CoilFault(IntFlag):
    """What has taken the output to zero; it stays there until it is reset."""

    NONE = 0
    OVER_TEMPERATURE = 1
    OPEN_COIL = 2
    OVER_CURRENT = 4


_KNOWN_FAULTS = sum(CoilFault)


class CoilState(IntFlag):
    """What the amplifier is doing."""

    IDLE = 0
    OUTPUT_ON = 1
    RAMPING = 2
    WATCHDOG_TRIPPED = 4


class Condition(NamedTuple):
    """All that the amplifier says of itself."""

    fault: CoilFault
    state: CoilState
    output: float
    """What the output is set to at this moment, ramp and table included [V or A]."""

    @property
    def words(self) -> str:
        """For a person; empty where all is well."""
        names = [fault.name or "" for fault in self.fault]
        if unknown := int(self.fault) & ~_KNOWN_FAULTS:
            names.append(f"fault {unknown:02X}h, see the amplifier's manual")
        if self.state & CoilState.WATCHDOG_TRIPPED:
            names.append("watchdog tripped: nobody spoke for too long")
        return ", ".join(name.lower().replace("_", " ") for name in names)


class CoilAmplifier(ModbusInstrument):
    """One amplifier on its wire."""

    def __init__(
        self,
        name: str,
        address: ModbusAddress,
        clock: Clock,
        *,
        mode: Mode = "voltage",
        ramp: float = 100.0,
        watchdog: float = 0.5,
        unit: int | None = None,
        timeout: float = 0.2,
    ) -> None:
        """Prepare; nothing is opened yet.

        Args:
            name: in configuration, logs and messages.
            address: of its wire; a baud rate that is left out is that of its wire file.
            clock: the bench clock.
            mode: whether it holds voltage or current; the drive is in V or in A accordingly.
            ramp: [V/s or A/s] towards a new setpoint and, when nobody speaks, to zero.
            watchdog: [s] of silence after which it ramps to zero, 0.05 to 10.
            unit: its Modbus number; its wire file's if none.
            timeout: [s] of silence after which a request has failed.

        Raises:
            OutOfRange: the serial line does not carry its samples, or a setting is out of its range.
        """
        super().__init__(name, "coil_amplifier", address, clock, unit, timeout)
        registers = self._registers.map.registers
        self._mode: Mode = mode
        self._settings = {
            "ramp": registers["ramp"].channel().checked(ramp),
            "watchdog": registers["watchdog"].channel().checked(watchdog),
        }
        limit = float(self._registers.map.document["limits"][mode])
        drive = replace(registers["setpoint"], low=-limit, high=limit).channel()
        self._drive = replace(drive, name="coil_drive", unit=DRIVE_UNITS[mode])
        self._table = StepTable(self._registers, self._drive)
        self._unconfirmed = ""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Voltage and current as measured, and the drive that is asked for."""
        return (*super().channels, self._drive)

    @property
    def faults(self) -> CoilFault:
        """Its faults, from the newest block; `condition` asks anew."""
        return CoilFault(self._ring.status & 0xFF)

    @property
    def state(self) -> CoilState:
        """What it is doing, from the newest block; `condition` asks anew."""
        return CoilState(self._ring.status >> 8)

    def connect(self) -> None:
        """Open the wire, check who answers, bring the output to zero, set mode, ramp and watchdog.

        Raises:
            NotConnected: the wire cannot be opened.
            NoReply, BadReply: it opens, but no coil amplifier answers.
            Refused: it is in a fault that does not go away, or does not take a setting.
        """
        super().connect()
        try:
            self._configure()
        except DriverError:
            super().close()
            raise

    def close(self) -> None:
        """Bring the output to zero where that can still be done, and close the wire."""
        if self._line.connected:
            self.make_safe()
        super().close()

    def read(self, channel: str) -> Reading:
        """The newest measured sample, or for ``coil_drive`` what the output is set to at this moment.

        Raises:
            OutOfRange: it has no such channel.
            NotConnected, NoReply, BadReply, Refused: it did not come.
        """
        if channel != self._drive.name:
            return super().read(channel)
        found, answer = self._registers.read_together("output")
        value, raw = found["output"]
        return Reading(value, answer.received_ns, None, raw, "good")

    def write(self, channel: str, value: float) -> None:
        """Set the drive; the output goes there by the ramp.

        Raises:
            OutOfRange: it is too large, or is not the drive; nothing was sent.
            NotConnected, NoReply, BadReply: not confirmed.
            Refused: a fault, the watchdog or a running table forbids it; the message says which.
        """
        if channel != self._drive.name:
            raise OutOfRange(f"{self.name}: {channel} is measured and cannot be set; coil_drive can")
        try:
            self._registers.write("setpoint", self._drive.checked(value))
        except Refused as error:
            words = self.condition().words or f"its table is {self._table.progress().state.name.lower()}"
            raise Refused(f"{error}; {words}; reset it, or abort the table") from error

    def condition(self) -> Condition:
        """Faults, state and output, asked for now.

        Raises:
            NotConnected, NoReply, BadReply, Refused: they did not come.
        """
        found, _ = self._registers.read_together("fault", "state", "output")
        return Condition(CoilFault(found["fault"].raw), CoilState(found["state"].raw), found["output"].value)

    def reset(self) -> None:
        """Clear the tripped watchdog, and faults whose cause has gone; the output stays at zero.

        Raises:
            NotConnected, NoReply, BadReply: not confirmed.
            Refused: a fault is still there.
        """
        self._registers.write("reset", 1)
        if words := self.condition().words:
            raise Refused(f"{self.name}: after a reset still: {words}; find the cause")

    @property
    def table_capacity(self) -> int:
        """Steps that its table holds."""
        return self._table.capacity

    def upload(self, times: Numbers, levels: Numbers) -> None:
        """Bring steps into its table and read them back; nothing moves yet.

        Args:
            times: (steps,) [s] after the trigger, from 0 or later, rising.
            levels: (steps,) of the drive [V or A], each from its time on; the last one stays.

        Raises:
            OutOfRange: too many, not rising, or a level too large; nothing was sent.
            NotConnected, NoReply, Refused: not confirmed.
            BadReply: something else stands in the table.
        """
        self._table.upload(times, levels)

    def arm(self) -> None:
        """Let the table start with the next trigger (the SYNC input).

        Raises:
            NotConnected, NoReply, BadReply, Refused: it is not armed.
        """
        self._table.command("arm")

    def abort_table(self) -> None:
        """Stop the table; the output stays where it is.

        Raises:
            NotConnected, NoReply, BadReply, Refused: not confirmed.
        """
        self._table.command("abort")

    def table(self) -> TableProgress:
        """How far the table is, asked for now.

        Raises:
            NotConnected, NoReply, BadReply, Refused: it did not say.
        """
        return self._table.progress(self._ring.device_ns)

    def make_safe(self) -> None:
        """Bring the output to zero by its ramp; where the wire is dead, the amplifier's watchdog does it."""
        # Twice: after an answer that was lost the wire is opened anew, or in step again, with the next request.
        for _ in range(2):
            try:
                # An amplifier that has nothing to abort may say so: no reason to leave its output on.
                with contextlib.suppress(Refused):
                    self.abort_table()
                self._registers.write("setpoint", 0.0)
            except DriverError as error:  # refused in a fault or after its watchdog: it is at zero or on its way
                self._unconfirmed = f"zero output not confirmed: {error}"
                continue
            self._unconfirmed = ""
            return

    def health(self) -> Health:
        """Counts and state, faults included."""
        health = super().health()
        words = health.words or Condition(self.faults, self.state, 0.0).words
        return replace(health, words="; ".join(filter(None, [self._unconfirmed, words])))

    def _wait_for_zero(self) -> None:
        deadline = time.monotonic() + _LONGEST_RAMP
        while (output := self.condition().output) != 0.0:
            if time.monotonic() > deadline:
                raise Refused(
                    f"{self.name}: the output is still at {output:.4g} {self._drive.unit} after "
                    f"{_LONGEST_RAMP:.0f} s of waiting for zero; set a steeper ramp"
                )
            time.sleep(0.01)

    def _configure(self) -> None:
        registers = self._registers
        # In this order: while a table runs, in a fault, or at an output other than zero it refuses what follows.
        self.abort_table()
        self.reset()
        registers.write("setpoint", 0.0)
        self._wait_for_zero()
        for name, value in self._settings.items():
            registers.write(name, value)
        mode = CoilMode[self._mode.upper()]
        if registers.read("mode").raw != mode:
            registers.write("mode", mode)

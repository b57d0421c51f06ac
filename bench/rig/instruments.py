"""From ``bench.toml`` to the instruments themselves: each driver built, none of them opened yet."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias, cast

from bench.rig.alignment import DriveChannel
from bench.rig.config import (
    ActuatorSection,
    AsciiLoadCellSection,
    BenchConfig,
    CoilAmplifierSection,
    InstrumentSection,
    LoadCellSection,
    LvdtSection,
    ModbusSection,
    ThermometerSection,
    role_of,
)
from drivers.actuator import Actuator
from drivers.ascii_load_cell import AsciiLoadCell
from drivers.can_bus import CanAddress
from drivers.coil_amplifier import DRIVE_UNITS, CoilAmplifier
from drivers.errors import DriverError
from drivers.instrument import Clock, Instrument
from drivers.load_cell import LoadCell
from drivers.lvdt import Lvdt
from drivers.modbus_address import ModbusAddress
from drivers.servo_drive import ActuatorSettings
from drivers.thermometer import Thermometer

STALE_AFTER = 0.05
"""[s] without a setpoint until the drive stops by itself, where the agent has real-time priority."""
STALE_WITHOUT_PRIORITY = 0.15
"""[s] the same where it has not: under load, a thread of usual priority is held up for some 50 ms now and then."""

AnyInstrument: TypeAlias = Actuator | LoadCell | AsciiLoadCell | Lvdt | CoilAmplifier | Thermometer


class Named(NamedTuple):
    """One instrument and what the configuration says of it."""

    name: str
    driver: str
    address: str
    instrument: Instrument


@dataclass(frozen=True)
class Rig:
    """The instruments of one bench."""

    actuator: Actuator
    load_cell: LoadCell | AsciiLoadCell
    lvdt: Lvdt
    amplifier: CoilAmplifier
    thermometer: Thermometer | None
    named: tuple[Named, ...]
    """All of them, as the configuration has them."""
    drive_kind: str
    """coil_v or coil_a."""
    drive_unit: str
    """V or A."""
    drive_channel: DriveChannel
    """Channel that measures the drive."""

    @contextlib.contextmanager
    def connected(self) -> Iterator["Rig"]:
        """All wires open; on leaving, everything is made safe and closed.

        Raises:
            DriverError: some do not answer as themselves, all of which are named; the others are closed again.
        """
        with contextlib.ExitStack() as opened:
            faults: list[DriverError] = []
            for one in self.named:
                opened.callback(_closed, one.instrument)  # before: one that fails half-way is closed, too
                try:
                    one.instrument.connect()
                except DriverError as error:
                    # Whoever wires a bench wants all of what is wrong at once, not one instrument a try.
                    faults.append(error)
            if faults:
                raise _together(faults, len(self.named))
            yield self


def _together(faults: list[DriverError], instruments: int) -> DriverError:
    if len(faults) == 1:
        return faults[0]
    return DriverError(f"{len(faults)} of {instruments} instruments fail: {'; '.join(map(str, faults))}")


def _closed(instrument: Instrument) -> None:
    """Close it, come what may: the next one has to be closed as well."""
    with contextlib.suppress(DriverError):
        instrument.close()


def build_rig(config: BenchConfig, clock: Clock, *, prompt: bool) -> Rig:
    """The instruments of a configuration, none of them opened.

    Args:
        config: of the bench.
        clock: of the bench [ns].
        prompt: whether setpoints leave with real-time priority, so that the drive need not wait long for them.

    Raises:
        OutOfRange: a driver refuses a setting, such as a baud rate that does not carry the samples.
    """
    named = tuple(
        Named(name, section.driver, _address(section), cast("Instrument", _built(name, section, clock, prompt)))
        for name, section in config.instruments.items()
    )
    by_role = {role_of(one.driver): one.instrument for one in named}
    section = next(one for one in config.instruments.values() if isinstance(one, CoilAmplifierSection))
    by_current = section.mode == "current"
    return Rig(
        actuator=cast("Actuator", by_role["actuator"]),
        load_cell=cast("LoadCell | AsciiLoadCell", by_role["load_cell"]),
        lvdt=cast("Lvdt", by_role["lvdt"]),
        amplifier=cast("CoilAmplifier", by_role["coil_amplifier"]),
        thermometer=cast("Thermometer | None", by_role.get("thermometer")),
        named=named,
        drive_kind="coil_a" if by_current else "coil_v",
        drive_unit=DRIVE_UNITS[section.mode],
        drive_channel="coil_current" if by_current else "coil_voltage",
    )


def _built(name: str, section: InstrumentSection, clock: Clock, prompt: bool) -> AnyInstrument:
    match section:
        case ActuatorSection():
            return _actuator(name, section, clock, prompt)
        case LoadCellSection():
            return LoadCell(name, section.url, clock, rate=section.rate, baud=section.baud)
        case AsciiLoadCellSection():
            return AsciiLoadCell(name, section.url, clock, baud=section.baud)
        case LvdtSection():
            return Lvdt(name, _modbus(section), clock, unit=section.unit)
        case ThermometerSection():
            return Thermometer(name, _modbus(section), clock, unit=section.unit)
        case CoilAmplifierSection():
            return CoilAmplifier(
                name,
                _modbus(section),
                clock,
                mode=section.mode,
                ramp=section.ramp,
                watchdog=section.watchdog,
                unit=section.unit,
            )


def _actuator(name: str, section: ActuatorSection, clock: Clock, prompt: bool) -> Actuator:
    stale = section.stale_after or (STALE_AFTER if prompt else STALE_WITHOUT_PRIORITY)
    settings = ActuatorSettings(
        stale_after=stale,
        master_lost_after=2 * stale,
        travel=section.travel,
        top_speed=section.top_speed,
        torque=section.torque,
        following=section.following,
    )
    address = CanAddress(section.interface, section.channel, section.host, section.port)
    return Actuator(
        name,
        address,
        clock,
        node_id=section.node,
        master_id=section.master,
        settings=settings,
        clamped=section.clamped,
    )


def _modbus(section: ModbusSection) -> ModbusAddress:
    return ModbusAddress(section.url, section.baud, section.parity, section.stop_bits)


def _address(section: InstrumentSection) -> str:
    if isinstance(section, ActuatorSection):
        at = f"{section.host}:{section.port}" if section.interface == "socketcand" else section.channel
        return f"{section.interface}://{at}"
    return section.url

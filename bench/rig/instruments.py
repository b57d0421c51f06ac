"""Construction of the instruments that ``bench.toml`` names; none of them is opened."""

import contextlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias, TypeVar

from bench.config import (
    ActuatorSection,
    AsciiLoadCellSection,
    BenchConfig,
    CoilAmplifierSection,
    InstrumentSection,
    LoadCellSection,
    LvdtSection,
    ModbusSection,
    ThermometerSection,
)
from bench.rig.alignment import DriveChannel
from drivers import Clock, DriverError, Instrument
from drivers.actuator import Actuator, ActuatorSettings
from drivers.load_cell import AsciiLoadCell, LoadCell
from drivers.modbus import DRIVE_UNITS, CoilAmplifier, Lvdt, Thermometer
from drivers.transport import CanAddress, ModbusAddress

SETPOINT_TIMEOUT = 0.05
"""[s] Setpoint timeout of the drive if the agent has real-time priority."""
SETPOINT_TIMEOUT_WITHOUT_PRIORITY = 0.15
"""[s] Setpoint timeout without it: under load, a thread of ordinary priority is delayed by up to about 50 ms."""

AnyInstrument: TypeAlias = Actuator | LoadCell | AsciiLoadCell | Lvdt | CoilAmplifier | Thermometer
InstrumentT = TypeVar("InstrumentT", bound=AnyInstrument)


class RegisteredInstrument(NamedTuple):
    """Instrument with its name, driver and address in the configuration."""

    name: str
    driver: str
    address: str
    instrument: Instrument


@dataclass(frozen=True)
class Rig:
    """Instruments of one bench."""

    actuator: Actuator
    load_cell: LoadCell | AsciiLoadCell
    lvdt: Lvdt
    amplifier: CoilAmplifier
    thermometer: Thermometer | None
    instruments: tuple[RegisteredInstrument, ...]
    """All instruments in the order of the configuration."""
    drive_kind: str
    """coil_v or coil_a."""
    drive_unit: str
    """V or A."""
    drive_channel: DriveChannel
    """Channel that measures the drive."""

    @contextlib.contextmanager
    def connect_all(self) -> Iterator["Rig"]:
        """Open all wires; make everything safe and close it at the end.

        Raises:
            DriverError: instruments do not reply as expected; all of them are named, and all wires are closed.
        """
        with contextlib.ExitStack() as opened:
            errors: list[DriverError] = []
            for one in self.instruments:
                # Before it connects, so that an instrument that fails half-way is closed, too.
                opened.callback(_close_quietly, one.instrument)
                try:
                    one.instrument.connect()
                except DriverError as error:
                    errors.append(error)  # all errors are reported together, not one per attempt
            if errors:
                raise _combine_errors(errors, len(self.instruments))
            yield self


def _combine_errors(errors: list[DriverError], instruments: int) -> DriverError:
    if len(errors) == 1:
        return errors[0]
    return DriverError(f"{len(errors)} of {instruments} instruments fail: {'; '.join(map(str, errors))}")


def _close_quietly(instrument: Instrument) -> None:
    """Close an instrument; an error must not keep the others from being closed."""
    with contextlib.suppress(DriverError):
        instrument.close()


def build_rig(config: BenchConfig, clock: Clock, *, realtime: bool) -> Rig:
    """Build the instruments of a configuration without opening them.

    Args:
        config: configuration of the bench.
        clock: bench clock [ns].
        realtime: whether setpoints are sent with real-time priority, so that the drive may expect them sooner.

    Raises:
        OutOfRangeError: a driver refuses a setting, such as a baud rate that is too low for the samples.
    """
    built = {
        name: _build_instrument(name, section, clock, realtime) for name, section in config.instruments.items()
    }
    instruments = list(built.values())
    section = next(one for one in config.instruments.values() if isinstance(one, CoilAmplifierSection))
    is_current = section.mode == "current"
    load_cells = [one for one in instruments if isinstance(one, LoadCell | AsciiLoadCell)]
    thermometers = [one for one in instruments if isinstance(one, Thermometer)]
    return Rig(
        actuator=_select(instruments, Actuator),
        load_cell=load_cells[0],
        lvdt=_select(instruments, Lvdt),
        amplifier=_select(instruments, CoilAmplifier),
        thermometer=thermometers[0] if thermometers else None,
        instruments=tuple(
            RegisteredInstrument(name, section.driver, _format_address(section), built[name])
            for name, section in config.instruments.items()
        ),
        drive_kind="coil_a" if is_current else "coil_v",
        drive_unit=DRIVE_UNITS[section.mode],
        drive_channel="coil_current" if is_current else "coil_voltage",
    )


def _select(instruments: Iterable[AnyInstrument], kind: type[InstrumentT]) -> InstrumentT:
    """Return the instrument of a class; the configuration has exactly one."""
    return next(one for one in instruments if isinstance(one, kind))


def _build_instrument(name: str, section: InstrumentSection, clock: Clock, realtime: bool) -> AnyInstrument:
    match section:
        case ActuatorSection():
            return _build_actuator(name, section, clock, realtime)
        case LoadCellSection():
            return LoadCell(name, section.url, clock, rate=section.rate, baud=section.baud)
        case AsciiLoadCellSection():
            return AsciiLoadCell(name, section.url, clock, baud=section.baud)
        case LvdtSection():
            return Lvdt(name, _make_modbus_address(section), clock, unit=section.unit)
        case ThermometerSection():
            return Thermometer(name, _make_modbus_address(section), clock, unit=section.unit)
        case CoilAmplifierSection():
            return _build_amplifier(name, section, clock)


def _build_amplifier(name: str, section: CoilAmplifierSection, clock: Clock) -> CoilAmplifier:
    return CoilAmplifier(
        name,
        _make_modbus_address(section),
        clock,
        mode=section.mode,
        ramp=section.ramp,
        watchdog=section.watchdog,
        unit=section.unit,
    )


def _build_actuator(name: str, section: ActuatorSection, clock: Clock, realtime: bool) -> Actuator:
    address = CanAddress(section.interface, section.channel, section.host, section.port)
    return Actuator(
        name,
        address,
        clock,
        node_id=section.node,
        master_id=section.master,
        settings=_make_actuator_settings(section, realtime),
        clamped=section.clamped,
    )


def _make_actuator_settings(section: ActuatorSection, realtime: bool) -> ActuatorSettings:
    default = SETPOINT_TIMEOUT if realtime else SETPOINT_TIMEOUT_WITHOUT_PRIORITY
    timeout = section.setpoint_timeout or default
    return ActuatorSettings(
        setpoint_timeout=timeout,
        # Heartbeats accompany punctual setpoints only, so they may be absent for longer than setpoints.
        master_heartbeat_timeout=2 * timeout,
        # A machine that may send late may also receive late.
        drive_heartbeat_timeout=max(ActuatorSettings.drive_heartbeat_timeout, 2 * timeout),
        travel=section.travel,
        max_speed=section.max_speed,
        torque_limit=section.torque_limit,
        following_error_window=section.following_error_window,
    )


def _make_modbus_address(section: ModbusSection) -> ModbusAddress:
    return ModbusAddress(section.url, section.baud, section.parity, section.stop_bits)


def _format_address(section: InstrumentSection) -> str:
    if isinstance(section, ActuatorSection):
        host = f"{section.host}:{section.port}" if section.interface == "socketcand" else section.channel
        return f"{section.interface}://{host}"
    return section.url

"""``bench.toml``: which instruments stand on this bench, how they are reached, and what the bench bears.

Written by hand for a real bench, by ``mrbench sim`` for the simulated one. Everything is checked when it is read,
and an error names file, section, key, value and what is allowed.
"""

import tomllib
from collections import Counter
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import (
    Field,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
    ValidationError,
    field_validator,
    model_validator,
)

from bench.errors import ConfigError
from bench.faults import first_fault
from bench.methods.frozen import Frozen
from bench.safety.limits import Action, Matrix

_SLOWEST_RAMP = 20.0
"""[V/s or A/s] The amplifier's most, 24 V, comes to zero in 1.2 s: a run's end and every stop wait for that."""


class ActuatorSection(Frozen):
    """A servo drive: CANopen, CiA 402."""

    driver: Literal["actuator"]
    interface: Literal["socketcan", "socketcand"] = Field(
        description="kind of CAN bus: of this machine, or of a server"
    )
    channel: str = Field(default="can0", description="name of the bus")
    host: str = Field(default="127.0.0.1", description="of a socketcand server")
    port: int = Field(default=29536, ge=1, le=65535, description="of a socketcand server")
    node: int = Field(default=5, ge=1, le=126, description="[1] node id of the drive")
    master: int = Field(
        default=127, ge=1, le=127, description="[1] node id under which the bench's heartbeat is sent"
    )
    clamped: bool = Field(default=False, description="whether a specimen is clamped")
    travel: tuple[float, float] = Field(
        default=(-0.06, 0.06), description="[m] from home, least and largest position"
    )
    top_speed: PositiveFloat = Field(default=0.5, description="[m/s] faster setpoints are refused")
    torque: PositiveFloat = Field(default=1.2, description="[N m] limit of the motor")
    following: PositiveFloat = Field(
        default=5e-3, description="[m] by which the rod may stay behind before the drive stops by itself"
    )
    stale_after: float | None = Field(
        default=None,
        ge=0.02,
        le=0.5,
        description="[s] without a setpoint until the drive stops by itself; by default 0.05, or 0.15 where the "
        "agent gets no real-time priority",
    )

    @field_validator("travel")
    @classmethod
    def _with_room(cls, travel: tuple[float, float]) -> tuple[float, float]:
        if not travel[0] < travel[1]:
            raise ValueError("the least position stands first, the largest second")
        return travel


class LoadCellSection(Frozen):
    """A load cell with a framed stream."""

    driver: Literal["load_cell"]
    url: str = Field(description="/dev/tty..., socket://host:port or rfc2217://host:port")
    baud: PositiveInt | None = Field(default=None, description="[bit/s]; its wire file's by default")
    rate: PositiveInt = Field(default=1000, description="[Hz] samples a second")


class AsciiLoadCellSection(Frozen):
    """A load cell on a weighing indicator that sends lines of text."""

    driver: Literal["ascii_load_cell"]
    url: str = Field(description="/dev/tty..., socket://host:port or rfc2217://host:port")
    baud: PositiveInt | None = Field(default=None, description="[bit/s]; its wire file's by default")


class ModbusSection(Frozen):
    """What Modbus instruments have in common."""

    url: str = Field(description="tcp://host:port for Modbus TCP; a serial port as above for Modbus RTU")
    unit: int | None = Field(
        default=None, ge=1, le=247, description="[1] its Modbus number; its wire file's by default"
    )
    baud: PositiveInt | None = Field(
        default=None, description="[bit/s] of a serial line; its wire file's by default"
    )
    parity: Literal["N", "E", "O"] = Field(default="N", description="of a serial line: none, even or odd")
    stop_bits: Literal[1, 2] = Field(default=1, description="[1] of a serial line")


class LvdtSection(ModbusSection):
    """An LVDT conditioner: displacement."""

    driver: Literal["lvdt"]


class ThermometerSection(ModbusSection):
    """A thermometer: temperature of the specimen."""

    driver: Literal["thermometer"]


class CoilAmplifierSection(ModbusSection):
    """The coil amplifier."""

    driver: Literal["coil_amplifier"]
    mode: Literal["voltage", "current"] = Field(default="voltage", description="what it holds at its setpoint")
    ramp: float = Field(
        default=100.0, ge=_SLOWEST_RAMP, description="[V/s or A/s] towards a setpoint and, in a stop, to zero"
    )
    watchdog: float = Field(
        default=0.5, ge=0.05, le=10, description="[s] of silence after which it ramps to zero by itself"
    )


InstrumentSection: TypeAlias = Annotated[
    ActuatorSection
    | LoadCellSection
    | AsciiLoadCellSection
    | LvdtSection
    | ThermometerSection
    | CoilAmplifierSection,
    Field(discriminator="driver"),
]


class FilterSection(Frozen):
    """An analogue low-pass in front of a converter, as its data sheet says."""

    kind: Literal["butterworth"] = Field(default="butterworth", description="its family")
    order: int = Field(default=2, ge=1, le=8, description="[1] number of poles")
    cutoff: PositiveFloat = Field(description="[Hz] where it has fallen by 3 dB")


class ChannelSection(Frozen):
    """What is known of one channel beside what its instrument says: goes into every log."""

    filter: FilterSection | None = Field(default=None, description="its low-pass, if it has one")
    delay: NonNegativeFloat = Field(default=0.0, description="[s] conversion and transport beside the filter")
    calibration: str = Field(default="", description="who calibrated it, when, how well, in words")
    certificate: str = Field(default="", description="file of the certificate; it is attached to every log")


class LimitSection(Frozen):
    """The value beyond which each action is taken; left out, it is never taken for this quantity."""

    indicate: PositiveFloat | None = Field(default=None, description="an alarm; the run goes on")
    hold: PositiveFloat | None = Field(default=None, description="the motion fades out and the rod is held")
    controlled_stop: PositiveFloat | None = Field(default=None, description="the motion fades out, the run ends")
    trip: PositiveFloat | None = Field(default=None, description="coil and actuator come to rest at once; latched")

    def steps(self) -> dict[Action, float]:
        """The limits that are set."""
        return {Action[name.upper()]: value for name, value in self.model_dump(exclude_none=True).items()}


class LimitsSection(Frozen):
    """What the fixture bears, in either direction. A method's own limits hold beside these; the stricter wins."""

    force: LimitSection = Field(default=LimitSection(trip=5000.0), description="[N] at the load cell")
    displacement: LimitSection = Field(
        default=LimitSection(trip=0.055), description="[m] of the rod, by the drive's encoder"
    )
    actuator_velocity: LimitSection = Field(
        default=LimitSection(trip=0.6), description="[m/s] of the rod, by the drive"
    )
    following_error: LimitSection = Field(
        default=LimitSection(indicate=4e-3, trip=8e-3), description="[m] from where the rod was sent"
    )
    coil_current: LimitSection = Field(default=LimitSection(trip=3.0), description="[A] as measured")
    coil_voltage: LimitSection = Field(default=LimitSection(trip=24.0), description="[V] as measured")
    temperature: LimitSection = Field(
        default=LimitSection(indicate=60.0, controlled_stop=80.0), description="[degC] of the specimen"
    )
    force_age: LimitSection = Field(
        default=LimitSection(indicate=0.1, trip=0.3), description="[s] since the newest force sample"
    )
    setpoint_lateness: LimitSection = Field(
        default=LimitSection(indicate=0.02), description="[s] by which a setpoint left late"
    )

    def matrix(self) -> Matrix:
        """As the interlocks take it."""
        return {name: getattr(self, name).steps() for name in type(self).model_fields}  # type: ignore[misc]


ActionName: TypeAlias = Literal["none", "indicate", "hold", "controlled_stop", "trip"]


ROLES: dict[str, tuple[str, ...]] = {
    "actuator": ("actuator",),
    "load_cell": ("load_cell", "ascii_load_cell"),
    "lvdt": ("lvdt",),
    "coil_amplifier": ("coil_amplifier",),
    "thermometer": ("thermometer",),
}
"""What there is one of on a bench, and the drivers that can be it."""
_OPTIONAL = ("thermometer",)


def role_of(driver: str) -> str:
    """What an instrument of a driver is on the bench."""
    return next(role for role, drivers in ROLES.items() if driver in drivers)


class SilenceSection(Frozen):
    """What is done when an instrument falls silent while a run goes on; lost samples make it lossy in any case."""

    actuator: ActionName = Field(default="trip", description="the servo drive")
    load_cell: ActionName = Field(default="trip", description="of either kind")
    coil_amplifier: ActionName = Field(default="trip", description="the coil amplifier")
    lvdt: ActionName = Field(default="controlled_stop", description="without it there are no bench samples")
    thermometer: ActionName = Field(default="indicate", description="the thermometer")

    def action(self, driver: str) -> Action:
        """For an instrument of a driver."""
        name: ActionName = getattr(self, role_of(driver))
        return Action[name.upper()]


class RigSection(Frozen):
    """The bench itself."""

    name: str = Field(default="bench", description="for a person")
    folder: str = Field(default="runs", description="where logs go; from the folder of bench.toml")
    specimen: str = Field(default="", description="the damper that is mounted, where a run does not say")


class AgentSection(Frozen):
    """Where the rig agent listens; port * takes any free one."""

    commands: str = Field(default="tcp://127.0.0.1:5570", description="ZeroMQ address for commands")
    samples: str = Field(default="tcp://127.0.0.1:5571", description="ZeroMQ address that publishes")


ChannelName: TypeAlias = Literal[
    "displacement", "force", "actuator_position", "coil_voltage", "coil_current", "temperature"
]


class BenchConfig(Frozen):
    """All of ``bench.toml``."""

    instruments: dict[str, InstrumentSection] = Field(description="by name; names stand in logs and messages")
    channels: dict[ChannelName, ChannelSection] = Field(default={}, description="what is known of channels")
    limits: LimitsSection = Field(default=LimitsSection(), description="what the fixture bears")
    silence: SilenceSection = Field(default=SilenceSection(), description="what is done about silent instruments")
    rig: RigSection = Field(default=RigSection(), description="the bench itself")
    agent: AgentSection = Field(default=AgentSection(), description="where the rig agent listens")

    @model_validator(mode="after")
    def _one_of_each(self) -> Self:
        there: Counter[str] = Counter(section.driver for section in self.instruments.values())
        for role, drivers in ROLES.items():
            count = sum(there[driver] for driver in drivers)
            if count > 1 or (count == 0 and role not in _OPTIONAL):
                allowed = "one of them, or none" if role in _OPTIONAL else "one of them"
                raise ValueError(f"{count} instruments with driver {' or '.join(drivers)}; a bench has {allowed}")
        return self


def load_config(path: Path) -> BenchConfig:
    """The configuration in a file.

    Raises:
        ConfigError: it cannot be read, or does not describe a bench; the message names the place.
    """
    try:
        content = tomllib.loads(path.read_text("utf-8"))
        return BenchConfig.model_validate(content)
    except OSError as error:
        raise ConfigError(
            f"{path}: cannot be read ({error.strerror}); `mrbench sim` writes one for a start"
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: no TOML: {error}") from None
    except ValidationError as error:
        raise ConfigError(f"{path}: {_first_fault(error, content)}") from None


def _first_fault(error: ValidationError, content: dict[str, Any]) -> str:
    """Section, key, value and what is allowed, of the first fault; and how many more there are."""
    first, words = first_fault(error)
    # pydantic puts the driver, by which it chose the section's form, into the place.
    place = [
        step for index, step in enumerate(first["loc"]) if not (index == 2 and first["loc"][0] == "instruments")
    ]
    section = ".".join(str(step) for step in place[:-1])
    where = f"[{section}] {place[-1]}" if place else "the document"
    given = first["input"]
    value = f" = {given!r}" if isinstance(given, str | int | float | bool) else ""
    return f"{where}{value}: {words}"

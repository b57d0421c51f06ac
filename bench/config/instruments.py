"""Sections of the instruments, and their roles on a bench."""

from typing import Annotated, Literal, TypeAlias

from pydantic import AliasChoices, Field, PositiveFloat, PositiveInt, field_validator

from bench.validation import FrozenModel

_SLOWEST_RAMP = 20.0
"""[V/s or A/s] Lower limit of the ramp: the largest output, 24 V, is at zero after 1.2 s, for which stops wait."""
_BAUD = "[bit/s] baud rate; by default that of the wire file"


class ActuatorSection(FrozenModel):
    """Servo drive: CANopen, CiA 402."""

    driver: Literal["actuator"]
    interface: Literal["socketcan", "socketcand"] = Field(
        description="kind of CAN bus: on this machine, or on a server"
    )
    channel: str = Field(default="can0", description="name of the CAN bus")
    host: str = Field(default="127.0.0.1", description="host of the socketcand server")
    port: int = Field(default=29536, ge=1, le=65535, description="port of the socketcand server")
    node: int = Field(default=5, ge=1, le=126, description="[1] CANopen node id of the drive")
    master: int = Field(default=127, ge=1, le=127, description="[1] CANopen node id of the bench's heartbeat")
    clamped: bool = Field(default=False, description="whether a specimen is clamped")
    travel: tuple[float, float] = Field(
        default=(-0.06, 0.06), description="[m] smallest and largest position, from home"
    )
    max_speed: PositiveFloat = Field(
        default=0.5,
        validation_alias=AliasChoices("max_speed", "top_speed"),
        description="[m/s] faster setpoints are refused",
    )
    torque_limit: PositiveFloat = Field(
        default=1.2,
        validation_alias=AliasChoices("torque_limit", "torque"),
        description="[N m] limit of the motor",
    )
    following_error_window: PositiveFloat = Field(
        default=5e-3,
        validation_alias=AliasChoices("following_error_window", "following"),
        description="[m] largest following error; beyond it the drive stops by itself",
    )
    setpoint_timeout: float | None = Field(
        default=None,
        ge=0.02,
        le=0.5,
        validation_alias=AliasChoices("setpoint_timeout", "stale_after"),
        description="[s] without a setpoint until the drive stops by itself; by default 0.05, or 0.15 if the "
        "agent has no real-time priority",
    )

    @field_validator("travel")
    @classmethod
    def _check_travel(cls, travel: tuple[float, float]) -> tuple[float, float]:
        if not travel[0] < travel[1]:
            raise ValueError("give the smallest position first, the largest second")
        return travel


class LoadCellSection(FrozenModel):
    """Load cell with a binary stream of frames."""

    driver: Literal["load_cell"]
    url: str = Field(description="/dev/tty..., socket://host:port or rfc2217://host:port")
    baud: PositiveInt | None = Field(
        default=None, description="[bit/s] baud rate; by default that of the wire file"
    )
    rate: PositiveInt = Field(default=1000, description="[Hz] sampling rate")


class AsciiLoadCellSection(FrozenModel):
    """Load cell on a weighing indicator that sends lines of text."""

    driver: Literal["ascii_load_cell"]
    url: str = Field(description="/dev/tty..., socket://host:port or rfc2217://host:port")
    baud: PositiveInt | None = Field(
        default=None, description="[bit/s] baud rate; by default that of the wire file"
    )


class ModbusSection(FrozenModel):
    """Common part of all Modbus instruments."""

    url: str = Field(description="tcp://host:port for Modbus TCP; a serial port as above for Modbus RTU")
    unit: int | None = Field(
        default=None, ge=1, le=247, description="[1] Modbus unit number; by default that of the wire file"
    )
    baud: PositiveInt | None = Field(
        default=None, description="[bit/s] baud rate of a serial line; by default that of the wire file"
    )
    parity: Literal["N", "E", "O"] = Field(default="N", description="parity of a serial line: none, even or odd")
    stop_bits: Literal[1, 2] = Field(default=1, description="[1] stop bits of a serial line")


class LvdtSection(ModbusSection):
    """LVDT conditioner: displacement."""

    driver: Literal["lvdt"]


class ThermometerSection(ModbusSection):
    """Thermometer: temperature of the specimen."""

    driver: Literal["thermometer"]


class CoilAmplifierSection(ModbusSection):
    """Coil amplifier."""

    driver: Literal["coil_amplifier"]
    mode: Literal["voltage", "current"] = Field(default="voltage", description="controlled quantity")
    ramp: float = Field(
        default=100.0,
        ge=_SLOWEST_RAMP,
        description="[V/s or A/s] rate of change towards a setpoint and, in a stop, to zero",
    )
    watchdog: float = Field(
        default=0.5,
        ge=0.05,
        le=10,
        description="[s] time without a request after which it ramps to zero by itself",
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


ROLES: dict[str, tuple[str, ...]] = {
    "actuator": ("actuator",),
    "load_cell": ("load_cell", "ascii_load_cell"),
    "lvdt": ("lvdt",),
    "coil_amplifier": ("coil_amplifier",),
    "thermometer": ("thermometer",),
}
"""Roles of which a bench has one instrument each, and the drivers that can fill them."""
OPTIONAL_ROLES = ("thermometer",)


def find_role(driver: str) -> str:
    """Return the role of a driver on the bench."""
    return next(role for role, drivers in ROLES.items() if driver in drivers)

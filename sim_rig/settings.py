"""What a scenario says of each thing on the bench: actuator, amplifier, sensors, clocks, effects, faults.

SI units throughout. The defaults are those of a decent laboratory, which is not kind: a scenario names only
what differs. A sensor that is named replaces the default one whole, and what it leaves out is ideal.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]

ChannelName = Literal[
    "displacement",
    "force",
    "coil_drive",
    "actuator_position",
    "coil_current",
    "coil_voltage",
    "temperature",
]


class Setting(BaseModel):
    """Base of every part of a scenario: frozen, and unknown names are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, populate_by_name=True)


class Actuator(Setting):
    """The servo that moves the rod."""

    bandwidth: float = Field(default=40.0, gt=0, le=500, description="[Hz] of the position loop")
    damping: float = Field(default=0.8, gt=0, le=3, description="[1] damping ratio of the position loop")
    stiffness: float = Field(
        default=2e7, ge=1e5, le=1e12, description="[N/m] under load: the rod droops by force / stiffness"
    )
    command_lag: float = Field(
        default=2e-3, ge=1e-4, le=0.1, description="[s] time constant with which the loop takes up its command"
    )
    start_ramp: float = Field(
        default=0.5,
        ge=0,
        le=60,
        description="[s] over which the commanded motion fades in from its first position",
    )
    force: float = Field(
        default=1600.0,
        ge=10,
        le=1e6,
        description="[N] that its motor can push; over the wires, a damper that resists more holds the rod back",
    )


class Amplifier(Setting):
    """The coil's amplifier: it updates its output once a bench sample and then holds it."""

    bandwidth: float = Field(
        default=1e4, ge=10, le=1e5, description="[Hz] with which the output follows an update"
    )
    resistance: float = Field(default=5.0, gt=0, le=1e3, description="[ohm] of the coil")


class Thermal(Setting):
    """How the damper warms. The law does not feel it; an effect that does keeps its own account of the energy."""

    ambient: float = Field(
        default=22.0, ge=-60, le=120, description="[degC] of the room, and of the damper at the start"
    )
    capacity: float = Field(default=600.0, gt=1, description="[J/K] heat that warms the damper by one kelvin")
    loss: NotNegative = Field(default=1.5, description="[W/K] heat that it gives to the room")


class Filter(Setting):
    """An analogue low-pass in front of a converter."""

    kind: Literal["butterworth"] = Field(default="butterworth", description="its family")
    order: int = Field(default=2, ge=1, le=4, description="[1] number of poles")
    cutoff: float = Field(default=300.0, ge=1, le=2000, description="[Hz] where it has fallen by 3 dB")


class Sensor(Setting):
    """How one channel turns the truth into what it reports; every default is ideal.

    Figures are in the unit of the channel: m, N, V or A, degC.
    """

    noise: NotNegative = Field(default=0.0, description="[channel unit] standard deviation of white noise")
    slow_noise: NotNegative = Field(default=0.0, description="[channel unit] standard deviation of coloured noise")
    slow_noise_time: Positive = Field(default=0.5, description="[s] correlation time of the coloured noise")
    resolution: NotNegative = Field(default=0.0, description="[channel unit] step of the converter, 0 for none")
    limit: Positive | None = Field(default=None, description="[channel unit] reading beyond which it saturates")
    gain_error: float = Field(default=0.0, ge=-0.5, le=0.5, description="[1] relative error of the calibration")
    zero: float = Field(default=0.0, description="[channel unit] reading at nothing")
    zero_spread: NotNegative = Field(
        default=0.0, description="[channel unit] standard deviation of a further zero shift, drawn for each run"
    )
    drift: float = Field(default=0.0, description="[channel unit per s] of the zero")
    filter: Filter | None = Field(default=None, description="anti-alias filter")
    delay: float = Field(
        default=0.0,
        ge=0,
        le=0.1,
        description="[s] conversion and transport beside the filter, as the device claims",
    )
    jitter: float = Field(default=0.0, ge=0, le=1e-3, description="[s] standard deviation of each timestamp")
    rate: Positive | None = Field(
        default=None, description="[Hz] readings a second, held between; the bench's if null"
    )


class Sensors(Setting):
    """One sensor a channel. The zero shift of the load cell adds to the preload f0 of the damper."""

    displacement: Sensor = Field(
        default=Sensor(
            noise=2e-6, resolution=1e-6, limit=0.1, zero_spread=2e-5, filter=Filter(), delay=2e-4, jitter=1e-6
        ),
        description="LVDT at the actuator",
    )
    force: Sensor = Field(
        default=Sensor(
            noise=2.5, resolution=0.05, limit=1e4, zero_spread=2.0, filter=Filter(), delay=2e-4, jitter=1e-6
        ),
        description="load cell between actuator and damper",
    )
    coil_drive: Sensor = Field(
        default=Sensor(noise=1e-3, resolution=1e-4),
        description="drive at the coil, read half way through each update",
    )
    actuator_position: Sensor = Field(
        default=Sensor(noise=1e-6, resolution=5e-6, delay=1e-3, jitter=2e-5), description="encoder of the actuator"
    )
    coil_current: Sensor = Field(
        default=Sensor(noise=5e-4, resolution=1e-4), description="current through the coil"
    )
    coil_voltage: Sensor = Field(
        default=Sensor(noise=1e-3, resolution=1e-4), description="voltage across the coil"
    )
    temperature: Sensor = Field(
        default=Sensor(noise=0.03, resolution=0.01, rate=10.0), description="thermocouple on the cylinder"
    )


class Clock(Setting):
    """How far a device's clock is off, and how well the bench has mapped it onto its own."""

    ppm: float = Field(
        default=0.0, ge=-1000, le=1000, description="[ppm] rate error; the bench knows and removes it"
    )
    mapping_error: float = Field(
        default=0.0,
        ge=0,
        le=1e-2,
        description="[s] standard deviation of the offset that mapping leaves, drawn for each run",
    )
    wander: float = Field(
        default=0.0, ge=0, le=1e-2, description="[s] standard deviation of the slow drift that mapping leaves"
    )


class Clocks(Setting):
    """One clock a device; the bench's own is the coil amplifier's."""

    load_cell: Clock = Field(
        default=Clock(ppm=47.0, mapping_error=1e-5, wander=3e-6), description="of the load cell"
    )
    lvdt: Clock = Field(
        default=Clock(ppm=-38.0, mapping_error=1e-5, wander=3e-6), description="of the LVDT's converter"
    )
    coil_amplifier: Clock = Field(default=Clock(), description="of the coil amplifier: the bench's reference")
    actuator: Clock = Field(
        default=Clock(ppm=12.0, mapping_error=1e-5, wander=3e-6), description="of the servo drive"
    )
    thermometer: Clock = Field(default=Clock(ppm=-85.0, mapping_error=1e-3), description="of the thermometer")


class EffectInPlay(Setting):
    """An effect that is real today. Its form is that of the library; its values stand here alone."""

    name: str = Field(description="name in the library of effects")
    form: str | None = Field(default=None, description="functional form; the library's own if null")
    parameters: dict[str, float] = Field(description="[SI] values by the library's names")


class Fault(Setting):
    """A channel that fails for a while."""

    kind: Literal["stuck", "cut"] = Field(description="stuck: repeats its last value; cut: no value (NaN)")
    channel: ChannelName = Field(description="the channel that fails")
    start: NotNegative = Field(description="[s] after the start of the run")
    duration: Positive = Field(description="[s]")


class Specimen(Setting):
    """What the rig may say of the damper: its name plate."""

    serial: str = Field(default="LAB-001", description="serial number")
    model: str = Field(default="small laboratory damper", description="type on the name plate")


class NamedDamper(Setting):
    """The paper's fourteen parameters, SI; beta and gamma in 1/m^n, slopes per volt or ampere."""

    alpha_a: float = Field(description="[N/m] hysteretic stiffness at zero drive")
    alpha_b: float = Field(description="[N/(m drive)] its slope")
    beta: float = Field(description="[1/m^n] shape of the loop, loading")
    gamma: float = Field(description="[1/m^n] shape of the loop, unloading")
    eta: float = Field(description="[1/s] rate of the field behind the drive")
    A: float = Field(description="[1] gauge of the hysteretic variable")
    c0_a: float = Field(description="[N s/m] viscous damping at large velocity, zero drive")
    c0_b: float = Field(description="[N s/(m drive)] its slope")
    c1_a: float = Field(description="[N s/m] roll-off dashpot at low velocity, zero drive")
    c1_b: float = Field(description="[N s/(m drive)] its slope")
    k0: float = Field(description="[N/m] stiffness at large velocity")
    k1: float = Field(description="[N/m] accumulator stiffness")
    n: float = Field(description="[1] sharpness of the yield")
    x0: float = Field(description="[m] rest position of the accumulator spring")

    @model_validator(mode="after")
    def _turns(self) -> "NamedDamper":
        if self.beta + self.gamma <= 0:
            raise ValueError(f"beta + gamma is {self.beta + self.gamma:g}; the loop needs a positive sum")
        return self


_PLAINLY = {"missing": "is missing", "extra_forbidden": "there is no such key"}


def first_fault(error: ValidationError) -> str:
    """Where a document is wrong first, and what is wrong there, in words for the person who wrote it."""
    faults = error.errors(include_url=False)
    # Where a name or an object may stand, a fault inside the object says more than that it is no name.
    first = next((fault for fault in faults if fault["type"] != "string_type"), faults[0])
    place = ".".join(str(part) for part in first["loc"]) or "document"
    return f"{place}: {_PLAINLY.get(first['type'], first['msg'].removeprefix('Value error, '))}"

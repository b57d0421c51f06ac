"""Sections of a scenario: actuator, amplifier, sensors, clocks, effects, faults, damper.

SI units throughout. The defaults describe a decent laboratory with realistic sensor errors, so a scenario names
only what differs. A sensor that is named replaces the default one completely. Its omitted fields are ideal.
"""

from functools import cached_property
from typing import Annotated, Any, Literal

from pydantic import AliasChoices, BeforeValidator, Field, NonNegativeFloat, PositiveFloat, model_validator

from identification.damper.definitions import EffectFile, make_effect
from identification.damper.effects import EFFECTS, Effect
from sim_rig.validation import FrozenModel

ChannelName = Literal[
    "displacement",
    "force",
    "coil_drive",
    "actuator_position",
    "coil_current",
    "coil_voltage",
    "temperature",
]


class Actuator(FrozenModel):
    """The servo that moves the rod."""

    bandwidth: float = Field(default=40.0, gt=0, le=500, description="[Hz] of the position loop")
    damping: float = Field(default=0.8, gt=0, le=3, description="[1] damping ratio of the position loop")
    stiffness: float = Field(
        default=2e7, ge=1e5, le=1e12, description="[N/m] under load: the rod droops by force / stiffness"
    )
    command_lag: float = Field(
        default=2e-3, ge=1e-4, le=0.1, description="[s] time constant with which the loop follows its command"
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
        description="[N] limit of its motor; over the wires, a damper that resists more holds the rod back",
    )


class Amplifier(FrozenModel):
    """The coil's amplifier: it updates its output once per bench sample and then holds it."""

    bandwidth: float = Field(
        default=1e4, ge=10, le=1e5, description="[Hz] with which the output follows an update"
    )
    resistance: float = Field(default=5.0, gt=0, le=1e3, description="[ohm] of the coil")


class Thermal(FrozenModel):
    """Warming of the damper. The law does not depend on it; an effect that does integrates its own energy."""

    ambient: float = Field(
        default=22.0, ge=-60, le=120, description="[degC] of the room, and of the damper at the start"
    )
    capacity: float = Field(default=600.0, gt=1, description="[J/K] heat that warms the damper by one kelvin")
    loss: NonNegativeFloat = Field(default=1.5, description="[W/K] heat that the damper gives to the room")


class Filter(FrozenModel):
    """An analogue low-pass in front of a converter."""

    kind: Literal["butterworth"] = Field(default="butterworth", description="filter family")
    order: int = Field(default=2, ge=1, le=4, description="[1] number of poles")
    cutoff: float = Field(default=300.0, ge=1, le=2000, description="[Hz] at which it has fallen by 3 dB")


class Sensor(FrozenModel):
    """Errors and settings of one channel; every default is ideal.

    Values are in the unit of the channel: m, N, V or A, degC.
    """

    noise: NonNegativeFloat = Field(default=0.0, description="[channel unit] standard deviation of white noise")
    slow_noise: NonNegativeFloat = Field(
        default=0.0, description="[channel unit] standard deviation of coloured noise"
    )
    slow_noise_time: PositiveFloat = Field(default=0.5, description="[s] correlation time of the coloured noise")
    resolution: NonNegativeFloat = Field(
        default=0.0, description="[channel unit] step of the converter, 0 for none"
    )
    limit: PositiveFloat | None = Field(
        default=None, description="[channel unit] reading beyond which it saturates"
    )
    gain_error: float = Field(default=0.0, ge=-0.5, le=0.5, description="[1] relative error of the calibration")
    zero: float = Field(default=0.0, description="[channel unit] reading at a true value of zero")
    zero_spread: NonNegativeFloat = Field(
        default=0.0, description="[channel unit] standard deviation of a further zero shift, drawn for each run"
    )
    drift: float = Field(default=0.0, description="[channel unit per s] of the zero")
    filter: Filter | None = Field(default=None, description="anti-alias filter")
    delay: float = Field(
        default=0.0,
        ge=0,
        le=0.1,
        description="[s] conversion and transport, without the filter's lag, as the device reports it",
    )
    jitter: float = Field(default=0.0, ge=0, le=1e-3, description="[s] standard deviation of each timestamp")
    rate: PositiveFloat | None = Field(
        default=None, description="[Hz] readings per second, held in between; the bench's rate if null"
    )


class ForceSensor(Sensor):
    """Errors and settings of the load cell, and its shunt."""

    shunt: float = Field(
        default=1000.0,
        ge=-1e4,
        le=1e4,
        description="[N] force that its shunt simulates when a check switches it on, 0 without a shunt; "
        "the reading contains it with the gain error",
    )


class Sensors(FrozenModel):
    """One sensor per channel. The zero shift of the load cell adds to the preload f0 of the damper."""

    displacement: Sensor = Field(
        default=Sensor(
            noise=2e-6, resolution=1e-6, limit=0.1, zero_spread=2e-5, filter=Filter(), delay=2e-4, jitter=1e-6
        ),
        description="LVDT at the actuator",
    )
    force: ForceSensor = Field(
        default=ForceSensor(
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


class ClockDeviation(FrozenModel):
    """Deviation of a device's clock, and the error left after the bench has mapped it onto its own."""

    ppm: float = Field(
        default=0.0, ge=-1000, le=1000, description="[ppm] rate error; the bench knows and removes it"
    )
    mapping_error: float = Field(
        default=0.0,
        ge=0,
        le=1e-2,
        description="[s] standard deviation of the offset that mapping leaves, drawn for each run",
    )
    drift: float = Field(
        default=0.0,
        ge=0,
        le=1e-2,
        validation_alias=AliasChoices("drift", "wander"),
        description="[s] standard deviation of the slow drift that mapping leaves",
    )


class ClockDeviations(FrozenModel):
    """One clock per device; the coil amplifier's clock is the bench's reference."""

    load_cell: ClockDeviation = Field(
        default=ClockDeviation(ppm=47.0, mapping_error=1e-5, drift=3e-6), description="of the load cell"
    )
    lvdt: ClockDeviation = Field(
        default=ClockDeviation(ppm=-38.0, mapping_error=1e-5, drift=3e-6), description="of the LVDT's converter"
    )
    coil_amplifier: ClockDeviation = Field(
        default=ClockDeviation(), description="of the coil amplifier: the bench's reference"
    )
    actuator: ClockDeviation = Field(
        default=ClockDeviation(ppm=12.0, mapping_error=1e-5, drift=3e-6), description="of the servo drive"
    )
    thermometer: ClockDeviation = Field(
        default=ClockDeviation(ppm=-85.0, mapping_error=1e-3), description="of the thermometer"
    )


class ActiveEffect(FrozenModel):
    """An effect that this scenario switches on, with its hidden values.

    It is one of the library, or one that its definition describes.
    """

    name: str = Field(description="name in the library of effects, or that of the definition")
    form: str | None = Field(default=None, description="functional form; the effect's first form if null")
    parameters: dict[str, float] = Field(description="[SI] values by the parameter names of the effect")
    definition: EffectFile | None = Field(
        default=None,
        description="definition of an effect that the library does not have; the user's effect file if null",
    )

    @cached_property
    def effect(self) -> Effect:
        """The effect of the definition, or else that of the library.

        Raises:
            KeyError: there is no definition, and the library has no effect of this name.
        """
        return EFFECTS[self.name] if self.definition is None else make_effect(self.definition)


_FORMER_FAULT_KINDS = {"cut": "missing"}


def _rename_fault_kind(kind: Any) -> Any:
    return _FORMER_FAULT_KINDS.get(kind, kind) if isinstance(kind, str) else kind


class ChannelFault(FrozenModel):
    """A channel that fails for a while."""

    kind: Annotated[Literal["stuck", "missing"], BeforeValidator(_rename_fault_kind)] = Field(
        description="stuck: repeats its last value; missing: no value (NaN)"
    )
    channel: ChannelName = Field(description="the channel that fails")
    start: NonNegativeFloat = Field(description="[s] after the start of the run")
    duration: PositiveFloat = Field(description="[s]")


class Specimen(FrozenModel):
    """Name plate of the damper: all that the rig may reveal of it."""

    serial: str = Field(default="LAB-001", description="serial number")
    model: str = Field(default="small laboratory damper", description="type on the name plate")


class DamperParameters(FrozenModel):
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
    def _check_loop(self) -> "DamperParameters":
        if self.beta + self.gamma <= 0:
            raise ValueError(f"beta + gamma is {self.beta + self.gamma:g}; the loop needs a positive sum")
        return self

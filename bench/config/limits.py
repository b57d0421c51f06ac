"""Sections of the limits, and of the actions for silent instruments."""

from typing import Literal, TypeAlias

from pydantic import Field, PositiveFloat

from bench.config.instruments import find_role
from bench.safety import Action, LimitMatrix
from bench.validation import FrozenModel

ActionName: TypeAlias = Literal["none", "indicate", "hold", "controlled_stop", "trip"]


class LimitSection(FrozenModel):
    """Value beyond which each action is taken; an action without a value is never taken."""

    indicate: PositiveFloat | None = Field(default=None, description="alarm; the run continues")
    hold: PositiveFloat | None = Field(default=None, description="the motion fades out and the rod is held")
    controlled_stop: PositiveFloat | None = Field(default=None, description="the motion fades out, the run ends")
    trip: PositiveFloat | None = Field(default=None, description="coil and actuator are stopped at once; latches")

    def make_thresholds(self) -> dict[Action, float]:
        """Return the thresholds that are set."""
        return {Action[name.upper()]: value for name, value in self.model_dump(exclude_none=True).items()}


class LimitsSection(FrozenModel):
    """Limits of the fixture for either sign; a method's own limits apply in addition, and the stricter wins."""

    force: LimitSection = Field(default=LimitSection(trip=5000.0), description="[N] force at the load cell")
    displacement: LimitSection = Field(
        default=LimitSection(trip=0.055), description="[m] position of the rod, by the drive's encoder"
    )
    actuator_velocity: LimitSection = Field(
        default=LimitSection(trip=0.6), description="[m/s] velocity of the rod, by the drive"
    )
    following_error: LimitSection = Field(
        default=LimitSection(indicate=4e-3, trip=8e-3), description="[m] distance of the rod from its setpoint"
    )
    coil_current: LimitSection = Field(default=LimitSection(trip=3.0), description="[A] measured current")
    coil_voltage: LimitSection = Field(default=LimitSection(trip=24.0), description="[V] measured voltage")
    temperature: LimitSection = Field(
        default=LimitSection(indicate=60.0, controlled_stop=80.0), description="[degC] temperature of the specimen"
    )
    force_age: LimitSection = Field(
        default=LimitSection(indicate=0.1, trip=0.3), description="[s] time since the newest force sample"
    )
    setpoint_lateness: LimitSection = Field(
        default=LimitSection(indicate=0.02), description="[s] delay of a setpoint"
    )

    def make_limit_matrix(self) -> LimitMatrix:
        """Return the limits as the interlocks use them."""
        return {name: getattr(self, name).make_thresholds() for name in type(self).model_fields}  # type: ignore[misc]


class SilenceSection(FrozenModel):
    """Action if an instrument falls silent during a run; lost samples make the run lossy in any case."""

    actuator: ActionName = Field(default="trip", description="servo drive")
    load_cell: ActionName = Field(default="trip", description="load cell of either kind")
    coil_amplifier: ActionName = Field(default="trip", description="coil amplifier")
    lvdt: ActionName = Field(default="controlled_stop", description="LVDT; without it there are no bench samples")
    thermometer: ActionName = Field(default="indicate", description="thermometer")

    def get_action(self, driver: str) -> Action:
        """Return the action for an instrument of a driver."""
        name: ActionName = getattr(self, find_role(driver))
        return Action[name.upper()]

"""Scenario document ``mrbench.scenario/1``: specimen, effects, sensors, clocks and faults of the simulated rig.

The scenario is the only place that contains the true answer to an identification or diagnosis.
"""

from collections.abc import Iterable
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

from pydantic import AliasChoices, Field, ValidationError, field_validator, model_validator

from identification.damper import (
    COORDINATES,
    PARAMETER_SETS,
    PARAMETERS,
    Parameters,
    find_parameter_set,
    to_coordinates,
)
from sim_rig.errors import ScenarioError
from sim_rig.scenario.active_effects import check_bounds, check_effects
from sim_rig.scenario.alternative_effects import check_alternative_effects, rename_former_symbols
from sim_rig.scenario.sections import (
    ActiveEffect,
    Actuator,
    Amplifier,
    ChannelFault,
    ClockDeviations,
    DamperParameters,
    Sensors,
    Specimen,
    Thermal,
)
from sim_rig.validation import FrozenModel, describe_first_error


class Scenario(FrozenModel):
    """Everything that the simulated rig plays, hidden values included."""

    schema_: Literal["mrbench.scenario/1"] = Field(alias="schema", description="kind and version of this document")
    description: str = Field(default="", description="one line for a person")
    damper: str | DamperParameters = Field(
        default="laboratory", description="a shipped parameter set by name, or the paper's fourteen parameters"
    )
    drive_kind: Literal["driver_command_v", "coil_v", "coil_a"] = Field(
        default="coil_v", description="quantity that commands the damper"
    )
    drive_unit: Literal["V", "A"] = Field(default="V", description="unit of the drive")
    specimen: Specimen = Field(default=Specimen(), description="name plate")
    effects: tuple[ActiveEffect, ...] = Field(default=(), description="active effects, of the library or defined")
    alternative_effects: tuple[ActiveEffect, ...] = Field(
        default=(),
        max_length=3,
        validation_alias=AliasChoices("alternative_effects", "sealed"),
        description="active effects in alternative forms of the blind trial, instead of `effects`",
    )
    actuator: Actuator = Field(default=Actuator(), description="the servo that moves the rod")
    amplifier: Amplifier = Field(default=Amplifier(), description="the coil's amplifier")
    thermal: Thermal = Field(default=Thermal(), description="warming of the damper")
    sensors: Sensors = Field(default=Sensors(), description="sensor of each channel")
    clocks: ClockDeviations = Field(default=ClockDeviations(), description="device clocks")
    faults: tuple[ChannelFault, ...] = Field(default=(), description="channels that fail for a while")
    seed: int = Field(default=0, ge=0, description="[1] of all random numbers: noise, zero shifts, clock errors")
    nuisances: dict[str, Any] | None = Field(
        default=None, description="of a twin: residual channel delays of its fit; the rig does not play them"
    )
    baseline: dict[str, Any] | None = Field(default=None, description="of a twin: the fit without its effects")
    residual: dict[str, Any] | None = Field(
        default=None,
        description="of a twin: its learned residual, which predictions add; the rig does not play it",
    )
    provenance: dict[str, Any] | None = Field(default=None, description="of a twin: where it comes from")

    @property
    def parameters(self) -> Parameters:
        """The damper's fourteen parameters, SI."""
        if isinstance(self.damper, str):
            return PARAMETER_SETS[self.damper].parameters
        return Parameters(**self.damper.model_dump())

    @field_validator("damper")
    @classmethod
    def _check_damper(cls, damper: str | DamperParameters) -> str | DamperParameters:
        if isinstance(damper, str):
            if damper not in PARAMETER_SETS:
                raise ValueError(f"no parameter set {damper!r}; there are {_join_names(PARAMETER_SETS)}")
            find_parameter_set(damper)
        else:
            parameters = Parameters(**damper.model_dump())
            # A and n first: coordinates do not contain the gauge A, and cannot be computed with a wrong n.
            check_bounds([q for q in PARAMETERS if q.symbol in ("A", "n")], parameters._asdict())
            check_bounds(COORDINATES, to_coordinates(parameters)._asdict())
        return damper

    @field_validator("effects")
    @classmethod
    def _check_effects(cls, effects: tuple[ActiveEffect, ...]) -> tuple[ActiveEffect, ...]:
        return check_effects(effects)

    @field_validator("alternative_effects")
    @classmethod
    def _check_alternative_effects(cls, effects: tuple[ActiveEffect, ...]) -> tuple[ActiveEffect, ...]:
        renamed = tuple(rename_former_symbols(effect) for effect in effects)
        check_alternative_effects(renamed)
        return renamed

    @model_validator(mode="after")
    def _check_one_kind_of_effects(self) -> "Scenario":
        if self.alternative_effects and self.effects:
            raise ValueError("`alternative_effects` cannot be combined with `effects`; leave `effects` empty")
        return self

    @model_validator(mode="after")
    def _check_unit(self) -> "Scenario":
        unit = "A" if self.drive_kind == "coil_a" else "V"
        if self.drive_unit != unit:
            raise ValueError(f"drive_unit is {self.drive_unit}, but {self.drive_kind} is in {unit}")
        if isinstance(self.damper, str) and PARAMETER_SETS[self.damper].drive_unit != unit:
            damper_unit = PARAMETER_SETS[self.damper].drive_unit
            raise ValueError(f"damper {self.damper} is driven in {damper_unit}, but drive_unit is {unit}")
        return self


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Return a shipped scenario by its name, otherwise the one in a file.

    Raises:
        ScenarioError: there is no such scenario, or it is not valid; the message names the place and the reason.
    """
    shipped = files("sim_rig.scenario") / "library" / f"{name_or_path}.json"
    path = Path(name_or_path)
    try:
        text = shipped.read_text() if str(name_or_path) in list_shipped_scenarios() else path.read_text()
    except FileNotFoundError:
        raise ScenarioError(
            f"no scenario {name_or_path}: neither a file nor one of {_join_names(list_shipped_scenarios())}"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"scenario {name_or_path}: cannot be read: {error}") from error
    return parse_scenario(text, str(name_or_path))


def parse_scenario(text: str, origin: str) -> Scenario:
    """Return the scenario in a JSON text; ``origin`` names it in messages.

    Raises:
        ScenarioError: the text is not a valid scenario.
    """
    try:
        return Scenario.model_validate_json(text)
    except ValidationError as error:
        raise ScenarioError(f"scenario {origin}: {describe_first_error(error)}") from error


def list_shipped_scenarios() -> list[str]:
    """Return the names of the scenarios that come with the rig."""
    folder = files("sim_rig.scenario") / "library"
    return sorted(f.name.removesuffix(".json") for f in folder.iterdir() if f.name.endswith(".json"))


def _join_names(names: Iterable[str]) -> str:
    return ", ".join(sorted(names)) or "none"

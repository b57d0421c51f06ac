"""A scenario: which specimen, which effects, which sensors the simulated rig plays (``mrbench.scenario/1``).

The answer to every identification and diagnosis lives here and nowhere else.
"""

import json
from collections.abc import Iterable
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, ValidationError, field_validator, model_validator

from identification.damper.coordinates import COORDINATES, to_coordinates
from identification.damper.effects import EFFECTS
from identification.damper.parameter_sets import PARAMETER_SETS, parameter_set
from identification.damper.parameters import PARAMETERS, Parameters, Quantity
from sim_rig.errors import ScenarioError
from sim_rig.sealed_effects import check_sealed
from sim_rig.settings import (
    Actuator,
    Amplifier,
    Clocks,
    EffectInPlay,
    Fault,
    NamedDamper,
    Sensors,
    Setting,
    Specimen,
    Thermal,
    first_fault,
)


class Scenario(Setting):
    """Everything that the simulated rig plays, with its hidden values."""

    schema_: Literal["mrbench.scenario/1"] = Field(alias="schema", description="kind and version of this document")
    description: str = Field(default="", description="one line for a person")
    damper: str | NamedDamper = Field(
        default="laboratory", description="a shipped parameter set by name, or the paper's fourteen parameters"
    )
    drive_kind: Literal["driver_command_v", "coil_v", "coil_a"] = Field(
        default="coil_v", description="what commands the damper"
    )
    drive_unit: Literal["V", "A"] = Field(default="V", description="unit of the drive")
    specimen: Specimen = Field(default=Specimen(), description="name plate")
    effects: tuple[EffectInPlay, ...] = Field(default=(), description="what is real beside the law")
    sealed: tuple[EffectInPlay, ...] = Field(
        default=(), max_length=3, description="the same in the trial's own forms, instead of `effects`"
    )
    actuator: Actuator = Field(default=Actuator(), description="the servo that moves the rod")
    amplifier: Amplifier = Field(default=Amplifier(), description="the coil's amplifier")
    thermal: Thermal = Field(default=Thermal(), description="how the damper warms")
    sensors: Sensors = Field(default=Sensors(), description="truth to reading, per channel")
    clocks: Clocks = Field(default=Clocks(), description="device clocks")
    faults: tuple[Fault, ...] = Field(default=(), description="channels that fail for a while")
    seed: int = Field(default=0, ge=0, description="[1] of everything drawn: noise, zero shifts, clock errors")
    nuisances: dict[str, Any] | None = Field(
        default=None, description="of a twin: lags that its fit left in the channels; a rig's own clocks are exact"
    )
    baseline: dict[str, Any] | None = Field(default=None, description="of a twin: the fit without its effects")
    provenance: dict[str, Any] | None = Field(default=None, description="of a twin: where it comes from")

    @property
    def parameters(self) -> Parameters:
        """The damper's fourteen parameters, SI."""
        if isinstance(self.damper, str):
            return PARAMETER_SETS[self.damper].parameters
        return Parameters(**self.damper.model_dump())

    @field_validator("damper")
    @classmethod
    def _known_damper(cls, damper: str | NamedDamper) -> str | NamedDamper:
        if isinstance(damper, str):
            if damper not in PARAMETER_SETS:
                raise ValueError(f"no parameter set {damper!r}; there are {_listed(PARAMETER_SETS)}")
            parameter_set(damper)
        else:
            parameters = Parameters(**damper.model_dump())
            # First these two: coordinates know nothing of the gauge A, and cannot be made with a wrong n.
            _within([q for q in PARAMETERS if q.symbol in ("A", "n")], parameters._asdict())
            _within(COORDINATES, to_coordinates(parameters)._asdict())
        return damper

    @field_validator("effects")
    @classmethod
    def _known_effects(cls, effects: tuple[EffectInPlay, ...]) -> tuple[EffectInPlay, ...]:
        for effect in effects:
            _check_effect(effect)
        names = [effect.name for effect in effects]
        if len(set(names)) < len(names):
            raise ValueError(f"an effect stands twice among {_listed(names)}; merge its entries")
        return effects

    @model_validator(mode="after")
    def _sealed_alone(self) -> "Scenario":
        if self.sealed and self.effects:
            raise ValueError("sealed forms stand alone; leave `effects` empty")
        check_sealed(self.sealed)
        return self

    @model_validator(mode="after")
    def _one_unit(self) -> "Scenario":
        unit = "A" if self.drive_kind == "coil_a" else "V"
        if self.drive_unit != unit:
            raise ValueError(f"drive_unit is {self.drive_unit}, but {self.drive_kind} is in {unit}")
        if isinstance(self.damper, str) and PARAMETER_SETS[self.damper].drive_unit != unit:
            wanted = PARAMETER_SETS[self.damper].drive_unit
            raise ValueError(f"damper {self.damper} is driven in {wanted}, but drive_unit is {unit}")
        return self


def load_scenario(name_or_path: str | Path) -> Scenario:
    """A shipped scenario by its name, otherwise the one in a file.

    Raises:
        ScenarioError: there is no such scenario, or it is not valid; one line says where and why.
    """
    shipped = files("sim_rig") / "scenarios" / f"{name_or_path}.json"
    path = Path(name_or_path)
    try:
        text = shipped.read_text() if str(name_or_path) in shipped_scenarios() else path.read_text()
    except FileNotFoundError:
        raise ScenarioError(
            f"no scenario {name_or_path}: neither a file nor one of {_listed(shipped_scenarios())}"
        ) from None
    except (OSError, UnicodeDecodeError) as error:
        raise ScenarioError(f"scenario {name_or_path}: cannot be read: {error}") from error
    return parse_scenario(text, str(name_or_path))


def parse_scenario(text: str, origin: str) -> Scenario:
    """The scenario in a JSON text; ``origin`` names it in messages.

    Raises:
        ScenarioError: the text is no valid scenario.
    """
    try:
        return Scenario.model_validate_json(text)
    except ValidationError as error:
        raise ScenarioError(f"scenario {origin}: {first_fault(error)}") from error


def shipped_scenarios() -> list[str]:
    """Names of the scenarios that come with the rig."""
    folder = files("sim_rig") / "scenarios"
    return sorted(f.name.removesuffix(".json") for f in folder.iterdir() if f.name.endswith(".json"))


def scenario_schema() -> str:
    """The JSON Schema of the document, as committed in the reference."""
    return json.dumps(Scenario.model_json_schema(by_alias=True), indent=2) + "\n"


def _check_effect(effect: EffectInPlay) -> None:
    known = EFFECTS.get(effect.name)
    if known is None:
        raise ValueError(f"no effect {effect.name!r}; there are {_listed(EFFECTS)}")
    forms = [form.name for form in known.forms]
    if effect.form is not None and effect.form not in forms:
        raise ValueError(f"{effect.name} has the form {_listed(forms)}, not {effect.form}")
    quantities = known.form(effect.form).parameters
    wanted = {quantity.symbol for quantity in quantities}
    if effect.parameters.keys() != wanted:
        raise ValueError(f"{effect.name} takes {_listed(wanted)}, not {_listed(effect.parameters)}")
    _within(quantities, effect.parameters, f"{effect.name}.")


def _within(quantities: Iterable[Quantity], values: dict[str, float], prefix: str = "") -> None:
    for q in quantities:
        # Coordinates are computed: one at its bound may come out a last digit beyond it.
        value, rounding = values[q.symbol], 1e-9 * (abs(q.low) + abs(q.high))
        if not q.low - rounding <= value <= q.high + rounding:
            unit = "" if q.unit == "1" else f" {q.unit_for('drive')}"
            raise ValueError(
                f"{prefix}{q.symbol} ({q.meaning}) is {value:g}{unit}, outside {q.low:g} to {q.high:g}{unit}"
            )


def _listed(names: Iterable[str]) -> str:
    return ", ".join(sorted(names)) or "none"

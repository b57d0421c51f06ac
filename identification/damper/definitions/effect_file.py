"""Effect file, mrbench.effect/1: an effect of the user's own as data."""

from collections.abc import Iterable, Sequence
from typing import Annotated, Literal, Self, get_args

from pydantic import ConfigDict, Field, StringConstraints, ValidationError, model_validator

from identification.damper.definitions.expression import FUNCTIONS, Expression
from identification.damper.effects import EFFECTS, Place, Stage, Variable
from identification.errors import EffectFileError
from identification.validation import FrozenModel, describe_validation_error

Name = Annotated[str, StringConstraints(pattern=r"^[a-z_]+$", max_length=40)]
Unit = Annotated[str, StringConstraints(pattern=r"^([^{}]|\{drive\})+$", max_length=40)]
_RESERVED = {"curve", *FUNCTIONS, *get_args(Variable)}
"""Names that no parameter may have."""
_MOTION: tuple[Variable, ...] = ("displacement", "velocity", "acceleration")
_PATH: tuple[Variable, ...] = ("travel_since_reversal", "travel_since_rest")
_DAMPER: tuple[Variable, ...] = (*_MOTION, *_PATH, "drive", "time", "dissipated_energy")
_COIL: tuple[Variable, ...] = ("drive", "drive_history", "time")
VARIABLES_AT: dict[Place, tuple[Variable, ...]] = {
    "drive": _COIL,
    "field": _COIL,
    "damper_gain": _DAMPER,
    "parallel_force": _DAMPER,
    "mounting": (*_DAMPER, "force"),
    "force_channel": ("force", "drive", "time"),
    "displacement_channel": ("displacement", "velocity", "time"),
}
"""Variables that can act at each place; in the mounting, the force acts without others."""
STAGE_OF: dict[Place, Stage] = {
    "drive": "coil",
    "field": "coil",
    "damper_gain": "damper",
    "parallel_force": "damper",
    "mounting": "mounting",
    "force_channel": "force_channel",
    "displacement_channel": "displacement_channel",
}
"""Stage of the signal chain to which each place belongs."""


_RESPONSE_VARIABLES: dict[Place, Variable] = {"drive": "drive_history", "force_channel": "force"}
"""Variable of a step response at each place that has one: the past of the drive, or the force."""
FunctionKind = Literal["value", "step_response"]
"""Meaning of a function: the value at its place, or the part of a change there that has arrived after a time."""


def is_elongation(place: Place, variables: Sequence[Variable]) -> bool:
    """Return True where the value at a place is the elongation of the mounting: a function of its force."""
    return place == "mounting" and "force" in variables


class EffectParameter(FrozenModel):
    """One parameter of a defined effect."""

    model_config = ConfigDict(allow_inf_nan=False)

    value: float = Field(description="usual value, at which a search starts")
    unit: Unit = Field(description="SI unit; {drive} stands for V or A")
    lo: float = Field(description="smallest value that a search tries")
    hi: float = Field(description="largest value that a search tries")

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if not self.lo <= self.value <= self.hi:
            raise ValueError(f"value is {self.value:g}, outside lo {self.lo:g} to hi {self.hi:g}")
        return self


class Curve(FrozenModel):
    """Function of one variable, given at points."""

    model_config = ConfigDict(allow_inf_nan=False)

    variable: Variable = Field(description="variable of the curve")
    unit: Unit = Field(description="SI unit of the values; {drive} stands for V or A")
    x: list[float] = Field(min_length=2, max_length=1000, description="values of the variable, increasing")
    value: list[float] = Field(description="values of the curve there")
    lo: list[float] | None = Field(default=None, description="lower bound of the 95 % band")
    hi: list[float] | None = Field(default=None, description="upper bound of the 95 % band")

    @model_validator(mode="after")
    def _check_points(self) -> Self:
        if any(b <= a for a, b in zip(self.x, self.x[1:], strict=False)):
            raise ValueError("x does not increase")
        for values in (self.value, self.lo, self.hi):
            if values is not None and len(values) != len(self.x):
                raise ValueError(f"{len(values)} values for {len(self.x)} points")
        return self


class EffectFile(FrozenModel):
    """An effect of the user's own: where it acts, on which variables, and its function."""

    model_config = ConfigDict(populate_by_name=True)

    schema_: Literal["mrbench.effect/1"] = Field(default="mrbench.effect/1", alias="schema")
    name: Name = Field(description="name in documents; none of the library")
    meaning: str = Field(default="", max_length=200, description="description for a person")
    stage: Stage = Field(description="stage of the signal chain, to which the place belongs")
    place: Place = Field(description="place in the signal chain")
    kind: FunctionKind = Field(
        default="value",
        description="value: the function is the value at the place; step_response: it is the part [1] of a change "
        "of the signal that has arrived at a `time` [s] after the change",
    )
    variables: list[Variable] = Field(min_length=1, max_length=3, description="variables, the main one first")
    expression: str | None = Field(
        default=None, description="expression over variables, parameters and `curve`; null for the curve alone"
    )
    parameters: dict[Name, EffectParameter] = Field(default_factory=dict, description="parameters by their names")
    curve: Curve | None = Field(default=None, description="curve over one of the variables")
    source: str = Field(default="", max_length=500, description="where the effect comes from")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.name in EFFECTS:
            raise ValueError(f"the library has an effect {self.name}; choose another name")
        if self.stage != STAGE_OF[self.place]:
            raise ValueError(f"place {self.place} belongs to stage {STAGE_OF[self.place]}, not {self.stage}")
        if len(set(self.variables)) < len(self.variables):
            raise ValueError(f"a variable is listed twice among {_join(self.variables)}")
        for variable in self.variables:
            if variable not in VARIABLES_AT[self.place]:
                raise ValueError(f"at {self.place} there are {_join(VARIABLES_AT[self.place])}, not {variable}")
        if is_elongation(self.place, self.variables) and len(self.variables) > 1:
            raise ValueError("in the mounting, force acts without other variables: the value is an elongation")
        if self.kind == "step_response" and [_RESPONSE_VARIABLES.get(self.place)] != self.variables:
            places = " or ".join(f"{place} over {variable}" for place, variable in _RESPONSE_VARIABLES.items())
            raise ValueError(f"a step response acts at {places} alone")
        if self.expression is None and self.curve is None:
            raise ValueError("there is neither an expression nor a curve")
        if self.curve is not None and self.curve.variable not in self.arguments:
            raise ValueError(f"the curve is over {self.curve.variable}, not over {_join(self.arguments)}")
        self._check_names()
        return self

    @property
    def arguments(self) -> list[Variable]:
        """Variables of the function: those of the effect, or the time since a change for a step response."""
        return ["time"] if self.kind == "step_response" else self.variables

    def _check_names(self) -> None:
        taken = sorted(set(self.parameters) & _RESERVED)
        if taken:
            raise ValueError(f"{_join(taken)} cannot be the name of a parameter")
        own = {*self.parameters, *(["curve"] if self.curve else [])}
        used = Expression.parse(self.expression or "curve").names
        unknown = used - own - set(self.arguments)
        if unknown:
            raise ValueError(f"the expression uses {_join(sorted(unknown))}, which is not declared")
        if own - used:
            raise ValueError(f"the expression does not use {_join(sorted(own - used))}")

    def describe(self) -> str:
        """Return the meaning, or else the expression and its place."""
        return self.meaning or f"{self.expression or 'a curve'} acts at {self.place.replace('_', ' ')}"


def _join(names: Iterable[str]) -> str:
    return ", ".join(names)


def parse_effect_file(text: str | bytes, origin: str) -> EffectFile:
    """Return the effect file in a JSON text; ``origin`` names it in messages.

    Raises:
        EffectFileError: the text is not a valid effect file; the message names the place and the reason.
    """
    try:
        return EffectFile.model_validate_json(text)
    except ValidationError as error:
        raise EffectFileError(f"{origin}: {_describe_refusal(error)}") from error


def _describe_refusal(error: ValidationError) -> str:
    """Return location and reason of the first error; the reason in full where a check of this module gives it."""
    first = error.errors()[0]
    reason = first.get("ctx", {}).get("error")
    if not isinstance(reason, ValueError):
        return describe_validation_error(error)
    location = ".".join(map(str, first["loc"]))
    return f"{location}: {reason}" if location else str(reason)

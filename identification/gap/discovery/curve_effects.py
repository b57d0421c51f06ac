"""Curve effects: an unknown curve at each place, over each variable that can act there.

The list follows the signal chain and not any known effect. A pair is left out where the recording cannot show it.
Examples are a curve over a drive with fewer than three levels, or over a variable that does not vary.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from identification.arrays import Array
from identification.damper import Quantity
from identification.damper.definitions import STAGE_OF, FunctionKind, find_action, is_elongation
from identification.damper.effects import Action, Effect, Form, Place, Variable
from identification.fitting import EffectModel, Piece, Problem, RecordingScales
from identification.gap.data import split_by_piece
from identification.gap.discovery.curve_basis import (
    FINE_KNOT_COUNT,
    KNOT_COUNT,
    MAX_GROWTH,
    CurveBasis,
    CurveFunction,
    Direction,
    LinearGrowth,
    Warp,
    make_basis,
    make_periodic_basis,
)
from identification.gap.noise import DRIFT_CURVE
from identification.simulate import DamperVariables, make_coil_variables

CURVE_EFFECT = "curve"
"""Name of every curve effect."""
_LARGEST = 100.0
"""Largest coefficient [1]."""
_MIN_GROWTH = -0.95
"""Smallest growth with the drive, over the inverse of the highest drive [1]."""
_MIN_LEVELS = 3
"""Smallest number of drive levels over which a curve is more than a straight line."""
_LEVEL_STEP = 0.02
"""Smallest difference between two levels of the drive, relative to the highest."""
_WARPS: dict[Variable, Warp] = {
    "velocity": "symmetric",
    "travel_since_reversal": "logarithmic",
    "travel_since_rest": "logarithmic",
}


HISTORY_VARIABLES: tuple[Variable, ...] = ("drive_history", "travel_since_rest", "dissipated_energy")
"""Variables that depend on the past of more than a stroke."""


class CurvePlace(NamedTuple):
    """A place with the variables of a curve there."""

    place: Place
    variables: tuple[Variable, ...]
    """The variable of the curve, then those of its factors."""
    grows_with_drive: bool = False
    is_viscous: bool = False
    """True where a parallel force is proportional to the velocity; else it has its sign."""
    period: float | None = None
    """Period of the curve, in the unit of its variable; None where it does not repeat."""
    is_response: bool = False
    """True where the curve is the part of a change that has not arrived yet, over the time since the change."""
    is_fine: bool = False
    """True where the curve resolves changes over time that return in few strokes."""

    @property
    def argument(self) -> Variable:
        """Variable of the curve."""
        return "time" if self.is_response else self.variables[0]

    @property
    def is_over_time(self) -> bool:
        """True for a curve over the time of the recording."""
        return self.argument == "time" and not self.is_response

    @property
    def warp(self) -> Warp:
        """Scale on which the knots of the curve are even."""
        return "logarithmic" if self.is_response else _WARPS.get(self.variables[0], "none")

    @property
    def direction(self) -> Direction:
        """Factor of the curve that depends on the velocity."""
        if "velocity" not in self.variables[1:]:
            return "none"
        return "velocity" if self.is_viscous or self.is_delay else "sign"

    @property
    def is_delay(self) -> bool:
        """True for an error of the displacement that is proportional to the velocity: a delay that varies."""
        return self.place == "displacement_channel" and "velocity" in self.variables[1:]

    @property
    def is_drift(self) -> bool:
        """True for a force over time alone, which slow noise can be as well."""
        return self.place == "force_channel" and self.is_over_time and not self.period

    @property
    def has_drive_factor(self) -> bool:
        """True where the curve is proportional to the drive."""
        return "drive" in self.variables[1:] and not self.grows_with_drive

    @property
    def is_elongation(self) -> bool:
        """True for the elongation of the connection over its force."""
        return is_elongation(self.place, self.variables)

    @property
    def action(self) -> Action:
        """Action of an effect with this curve."""
        return find_action(self.place, self.variables, self.kind)

    @property
    def kind(self) -> FunctionKind:
        """Kind of the function in an effect file."""
        return "step_response" if self.is_response else "value"

    @property
    def label(self) -> str:
        """Description for a person."""
        kind = "viscous " if self.is_viscous else "periodic " if self.period else ""
        kind = "step response of " if self.is_response else kind
        return f"{kind}{self.place} over {' and '.join(self.variables)}".replace("_", " ")


_POSITIONS: tuple[Variable, ...] = ("displacement", "travel_since_reversal", "travel_since_rest")
_PARALLEL = (
    CurvePlace("parallel_force", ("velocity",)),
    CurvePlace("parallel_force", ("displacement",)),
    *(CurvePlace("parallel_force", (variable, "velocity")) for variable in _POSITIONS),
    *(CurvePlace("parallel_force", (variable, "velocity"), is_viscous=True) for variable in _POSITIONS),
)
CURVE_PLACES: tuple[CurvePlace, ...] = (
    CurvePlace("drive", ("time", "drive")),
    CurvePlace("drive", ("drive_history",), is_response=True),
    CurvePlace("field", ("drive",)),
    CurvePlace("field", ("drive_history",)),
    *(
        CurvePlace("damper_gain", (variable,))
        for variable in (
            "displacement",
            "velocity",
            "travel_since_reversal",
            "travel_since_rest",
            "time",
            "dissipated_energy",
        )
    ),
    *_PARALLEL,
    *(at._replace(variables=(*at.variables, "drive"), grows_with_drive=True) for at in _PARALLEL),
    CurvePlace("mounting", ("acceleration",)),
    CurvePlace("mounting", ("force",)),
    CurvePlace("force_channel", ("force",)),
    CurvePlace("force_channel", ("force",), is_response=True),
    CurvePlace("force_channel", ("time",)),
    CurvePlace("force_channel", ("drive",)),
    CurvePlace("displacement_channel", ("displacement",)),
    CurvePlace("displacement_channel", ("velocity",)),
    CurvePlace("displacement_channel", ("time",)),
    CurvePlace("displacement_channel", ("time", "velocity")),
)
"""All places and variables that are tried."""
_PLACE_UNITS: dict[Place, str] = {
    "drive": "{drive}",
    "field": "{drive}",
    "damper_gain": "1",
    "parallel_force": "N",
    "mounting": "N",
    "force_channel": "N",
    "displacement_channel": "m",
}


@dataclass(frozen=True)
class CurveEffect:
    """An unknown curve at one place."""

    at: CurvePlace
    function: CurveFunction
    model: EffectModel
    """Effect of a fit, with the coefficients as parameters and no prior."""
    linear_model: EffectModel
    """Effect of the screening; the same unless the curve grows with the drive."""

    @property
    def unit(self) -> str:
        """Unit of the curve's values."""
        if self.at.has_drive_factor or self.at.is_response:
            return "1"
        if self.at.is_elongation:
            return "m"
        if self.at.is_delay:
            return "s"
        return "N s/m" if self.at.is_viscous else _PLACE_UNITS[self.at.place]


def list_curve_effects(
    problem: Problem, forces: Sequence[Array], line: float | None = None, finest_rate: float = 0.0
) -> list[CurveEffect]:
    """Return the curves that a recording can show.

    Args:
        problem: fitted pieces and their scales.
        forces: simulated force (N,) [N] of each piece.
        line: frequency [Hz] of a disturbance that is independent of the motion; None without one.
        finest_rate: sampling rate [Hz] that step responses resolve; at least that of the pieces.
    """
    values = collect_variables(problem.pieces, forces)
    periodic = () if line is None else (CurvePlace("force_channel", ("time",), period=1.0 / line),)
    rate = max(finest_rate, min(p.excitation.rate for p in problem.pieces))
    # After a cycle, a response looks like a gain.
    response_times = np.array([1.0 / rate, max(problem.space.scales.cycle_duration, 2.0 / rate)])
    return [
        _make_curve_effect(problem, at, response_times if at.is_response else values[at.variables[0]])
        for at in (*CURVE_PLACES, *periodic)
        if _is_visible(at, values, problem)
    ]


def make_fine_curve(problem: Problem, at: CurvePlace) -> CurveEffect:
    """Return a fine curve at a place over the time of some pieces."""
    time = np.concatenate([p.excitation.time for p in problem.pieces])
    return _make_curve_effect(problem, at._replace(is_fine=True), time)


def collect_variables(pieces: Sequence[Piece], forces: Sequence[Array]) -> dict[str, Array]:
    """Return all values (N,) of each variable."""
    names = {name for at in CURVE_PLACES for name in at.variables}
    tables: dict[str, list[Array]] = {name: [] for name in names}
    for piece, force in zip(pieces, forces, strict=True):
        stroke = piece.excitation
        damper = DamperVariables(stroke, stroke.displacement, stroke.velocity, stroke.acceleration)
        coil = make_coil_variables(stroke.sampled_drive, stroke.start, 1.0 / stroke.rate)
        recorded = {"force": force, "drive_history": coil["drive_history"]}
        for name in names:
            tables[name].append(recorded[name] if name in recorded else damper[name])
    return {name: np.concatenate(parts) for name, parts in tables.items()}


def _is_visible(at: CurvePlace, values: dict[str, Array], problem: Problem) -> bool:
    """Return True if the recording varies the variables of a curve."""
    if at.is_response:
        signal = "drive" if at.place == "drive" else "force"
        return any(np.ptp(part) > 0.0 for part in split_by_piece(values[signal], problem.pieces))
    highest = problem.space.scales.drive
    levels = len(np.unique(np.round(values["drive"] / (_LEVEL_STEP * highest))))
    if at.variables[0] in ("drive", "drive_history") and levels < _MIN_LEVELS:
        return False
    if "drive" in at.variables and levels < 2:
        return False
    return bool(np.ptp(values[at.variables[0]]) > 0.0)


def _make_curve_effect(problem: Problem, at: CurvePlace, values: Array) -> CurveEffect:
    scales = problem.space.scales
    function = CurveFunction(
        _make_basis(at, values),
        (at.argument, *at.variables[1:]),
        _find_size(at, scales),
        at.direction,
        at.has_drive_factor,
        at.grows_with_drive,
        at.is_response,
    )
    coefficients = _list_coefficients(function.basis.size)
    if not at.grows_with_drive:
        model = _make_model(at, coefficients, function)
        return CurveEffect(at, function, model, model)
    low, high = (bound / scales.drive for bound in (_MIN_GROWTH, MAX_GROWTH))
    growth = Quantity("growth", "1/{drive}", low, high, 1.0 / scales.drive, "growth with the drive")
    linear = _make_model(at, _list_coefficients(2 * function.basis.size), LinearGrowth(function, scales.drive))
    return CurveEffect(at, function, _make_model(at, (*coefficients, growth), function), linear)


def _make_basis(at: CurvePlace, values: Array) -> CurveBasis:
    if at.period:
        return make_periodic_basis(at.period)
    return make_basis(values, at.warp, FINE_KNOT_COUNT if at.is_fine else KNOT_COUNT)


def _find_size(at: CurvePlace, scales: RecordingScales) -> float:
    """Return the value of a curve of size one, in the unit of its place over that of its factors."""
    if at.is_elongation:
        return scales.length
    if at.is_response:
        return 1.0
    if at.is_delay:
        return 1.0 / scales.rate
    sizes: dict[Place, float] = {
        "drive": scales.drive if not at.has_drive_factor else 1.0,
        "field": scales.drive,
        "damper_gain": 1.0,
        "parallel_force": scales.damping if at.is_viscous else scales.force,
        "displacement_channel": scales.length,
    }
    return sizes.get(at.place, scales.force)


def _list_coefficients(count: int) -> tuple[Quantity, ...]:
    return tuple(Quantity(f"c{k}", "1", -_LARGEST, _LARGEST, 1.0, "coefficient") for k in range(count))


def _make_model(at: CurvePlace, quantities: tuple[Quantity, ...], function: Any) -> EffectModel:
    name = DRIFT_CURVE if at.is_drift else CURVE_EFFECT
    form = Form(name, at.action, quantities, ((0.0,) * len(quantities),), function)
    return EffectModel(Effect(CURVE_EFFECT, STAGE_OF[at.place], at.variables[0], at.label, (form,)), name)

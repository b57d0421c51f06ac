"""Cause outside the library in a report: its part of a diagnosis, and the text of its section."""

from typing import Any

from pydantic import Field

from bench.report.documents import DocumentPart, ParameterValue
from bench.report.values import format_force, format_name, format_quantity, format_share, format_unit

PLACE_QUANTITIES = {
    "drive": "added drive",
    "field": "added field",
    "damper_gain": "relative change of alpha, c0 and c1",
    "parallel_force": "added force",
    "mounting": "added force",
    "force_channel": "added force",
    "displacement_channel": "added displacement",
}
"""Quantity that the value of an effect is, by place."""
_ELONGATION = "elongation of the mounting"
"""The same for a function of the force in the mounting."""
_LEAD = "lead of the displacement"
"""The same for a curve of the displacement channel that is multiplied by the velocity."""
_STEP_RESPONSE = "step response"
"""The same for a curve over the time since a change."""
_RESPONSE_SENTENCE = "The curve is the part of a change that has arrived, over the time since the change."
VARIABLE_UNITS = {
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "travel_since_reversal": "m",
    "travel_since_rest": "m",
    "force": "N",
    "drive": "{drive}",
    "drive_history": "{drive}",
    "temperature": "K",
    "time": "s",
    "dissipated_energy": "J",
}
"""Unit of each variable; {drive} stands for V or A."""


class Curve(DocumentPart):
    """Curve over one variable, given at points."""

    variable: str = Field(description="variable of the curve")
    unit: str = Field(description="SI unit of the values")
    x: tuple[float, ...] = Field(description="values of the variable")
    value: tuple[float, ...] = Field(description="values of the curve there")
    lo: tuple[float, ...] | None = Field(default=None, description="lower bound of the 95 % band")
    hi: tuple[float, ...] | None = Field(default=None, description="upper bound of the 95 % band")


class Formula(DocumentPart):
    """Formula of a discovered effect."""

    expression: str
    symbols: dict[str, ParameterValue]


class DiscoveredCurve(DocumentPart):
    """An effect outside the library: place, variables and curve."""

    place: str
    variables: tuple[str, ...] = Field(description="variable of the curve, then those of its factors")
    curve: Curve
    rmse_n: float = Field(description="force error on held-out strokes with this effect, in N")

    @property
    def label(self) -> str:
        """Place and variables as text."""
        kind = f"{_STEP_RESPONSE} of the " if self.is_step_response else ""
        return f"{kind}{format_name(self.place)} over {join_words(self.variables)}"

    @property
    def is_step_response(self) -> bool:
        """True where the curve is the part of a change that has arrived, over the time since it."""
        return self.curve.variable not in self.variables


class Discovery(DiscoveredCurve):
    """Result of a search for a cause outside the library."""

    replaces: tuple[str, ...] = ()
    formula: Formula | None = None
    shrinkage: float | None = None
    shrinkage_ci95: tuple[float, float] | None = None
    further: tuple[DiscoveredCurve, ...] = ()

    @property
    def all_curves(self) -> tuple[DiscoveredCurve, ...]:
        """The effect and those that were found after it."""
        return (self, *self.further)


def join_words(names: tuple[str, ...] | list[str]) -> str:
    """Return names as a list in a sentence."""
    words = [format_name(name) for name in names]
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1]))) if words else ""


def get_quantity(found: DiscoveredCurve, drive_unit: str) -> str:
    """Return the quantity of a curve's values; ``drive_unit`` is V or A."""
    if found.place == "displacement_channel" and "velocity" in found.variables[1:]:
        return _LEAD
    quantity = _name_quantity(found)
    is_added = found.place in ("drive", "field") and not found.is_step_response
    return f"{quantity} over drive" if is_added and found.curve.unit != drive_unit else quantity


def make_discovery_context(discovery: Discovery, before: float, named: list[str]) -> dict[str, Any]:
    """Return the values for the page's template.

    Args:
        discovery: the cause outside the library.
        before: force error of the refitted law on held-out strokes [N].
        named: names of the named effects.
    """
    formula = discovery.formula
    return {
        "text": " ".join(_describe_discovery(discovery, before, named)),
        "formula": "" if formula is None else _write_formula(discovery, formula),
        "symbols": [] if formula is None else _make_symbol_rows(formula),
        "further": [
            (f.label, f"force error on held-out strokes {format_force(f.rmse_n)}") for f in discovery.further
        ],
    }


def _describe_discovery(discovery: Discovery, before: float, named: list[str]) -> list[str]:
    """Return the sentences on a discovered effect."""
    kept = [name for name in named if name not in discovery.replaces]
    together = f"With it{' and ' + join_words(kept) if kept else ''},"
    sentences = [
        f"An effect outside the library acts at the place “{format_name(discovery.place)}”.",
        f"It depends on {join_words(discovery.variables)}.",
        *([_RESPONSE_SENTENCE] if discovery.is_step_response else []),
        f"{together} the force error on held-out strokes falls from {format_force(before)} to "
        f"{format_force(discovery.rmse_n)}.",
    ]
    if discovery.shrinkage is not None:
        sentences.append(
            f"{together} the gap of another run is expected to shrink by "
            f"{format_share(discovery.shrinkage, discovery.shrinkage_ci95)}."
        )
    if discovery.replaces:
        verb = "is" if len(discovery.replaces) == 1 else "are"
        sentences.append(f"It replaces {join_words(discovery.replaces)}, which {verb} not needed with it.")
    if discovery.formula is None:
        sentences.append("No short formula does as well as its curve.")
    return sentences


def _write_formula(discovery: Discovery, formula: Formula) -> str:
    return f"{_name_quantity(discovery)} = {formula.expression}"


def _name_quantity(found: DiscoveredCurve) -> str:
    if found.is_step_response:
        return _STEP_RESPONSE
    if found.place == "mounting" and "force" in found.variables:
        return _ELONGATION
    return PLACE_QUANTITIES.get(found.place, f"value at {format_name(found.place)}")


def _make_symbol_rows(formula: Formula) -> list[tuple[str, str, str]]:
    """Make the rows of symbol, value with its interval, and unit."""
    rows = []
    for symbol, parameter in formula.symbols.items():
        quantity = format_quantity(parameter.value, parameter.ci95, parameter.unit)
        rows.append((symbol, quantity.value, "" if parameter.unit == "1" else quantity.unit))
    return rows


def get_variable_unit(variable: str, drive_unit: str) -> str:
    """Return the typeset unit of a variable; ``drive_unit`` is V or A."""
    return format_unit(VARIABLE_UNITS.get(variable, "1").format(drive=drive_unit))

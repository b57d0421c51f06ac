"""Definitions of effects for tests of the simulated rig."""

from typing import Any

from identification.damper.definitions import STAGE_OF


def define(
    place: str,
    expression: str | None,
    variables: list[str],
    curve: dict[str, Any] | None = None,
    kind: str = "value",
    **values: float,
) -> dict[str, Any]:
    """Return the entry of a scenario for a defined effect with parameters of these values."""
    parameters = {name: {"value": v, "unit": "N kg/K", "lo": -1e6, "hi": 1e6} for name, v in values.items()}
    definition = {
        "schema": "mrbench.effect/1",
        "name": "of_mine",
        "stage": STAGE_OF[place],
        "place": place,
        "kind": kind,
        "variables": variables,
        "expression": expression,
        "parameters": parameters,
        "curve": curve,
    }
    return {"name": "of_mine", "parameters": values, "definition": definition}

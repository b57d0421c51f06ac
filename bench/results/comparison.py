"""Changes between two results of one run, such as those of two versions of mrbench.

A parameter has changed if each of its two values is outside the 95 % interval of the other. Parameters that the
strokes do not determine have no interval and are left out.
"""

from collections.abc import Mapping
from typing import Any

from pydantic import Field

from bench.validation import FrozenModel


class ParameterChange(FrozenModel):
    """One parameter in both results."""

    name: str = Field(description="name of the parameter; `effect.name` for the parameter of an effect")
    unit: str = Field(description="SI unit")
    older: float = Field(description="older value, in `unit`")
    older_ci95: tuple[float, float] = Field(description="its 95 % interval, in `unit`")
    newer: float = Field(description="newer value, in `unit`")
    newer_ci95: tuple[float, float] = Field(description="its 95 % interval, in `unit`")
    changed: bool = Field(description="whether each value is outside the interval of the other")


class ResultChanges(FrozenModel):
    """Difference between two results of the same kind."""

    older: str = Field(description="id of the older job")
    newer: str = Field(description="id of the newer job")
    older_version: str = Field(description="version of mrbench that computed the older result")
    newer_version: str = Field(description="version of mrbench that computed the newer result")
    older_answer: str = Field(description="verdict of a diagnosis, or `result` of a fit")
    newer_answer: str = Field(description="the same of the newer one")
    answer_changed: bool
    effects_added: tuple[str, ...] = Field(description="effects that only the newer diagnosis names")
    effects_removed: tuple[str, ...] = Field(description="effects that only the older diagnosis names")
    parameters: tuple[ParameterChange, ...] = Field(description="those with an interval in both results")


def compare_results(older: Mapping[str, Any], newer: Mapping[str, Any], ids: tuple[str, str]) -> ResultChanges:
    """Compare two fits, or two diagnoses.

    Args:
        older: document of the older result.
        newer: document of the newer result, of the same kind.
        ids: ids of both jobs, the older first.
    """
    before, after = _collect_parameters(older), _collect_parameters(newer)
    names = [set(_list_effects(document)) for document in (older, newer)]
    answers = [str(document.get("verdict", document.get("result", ""))) for document in (older, newer)]
    return ResultChanges(
        older=ids[0],
        newer=ids[1],
        older_version=_get_version(older),
        newer_version=_get_version(newer),
        older_answer=answers[0],
        newer_answer=answers[1],
        answer_changed=answers[0] != answers[1],
        effects_added=tuple(sorted(names[1] - names[0])),
        effects_removed=tuple(sorted(names[0] - names[1])),
        parameters=tuple(_compare(name, before[name], after[name]) for name in before if name in after),
    )


def _collect_parameters(document: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    """Return the parameters with an interval, by name."""
    found = dict(document.get("parameters", {}))
    for effect in document.get("effects", []):
        found |= {f"{effect['name']}.{name}": value for name, value in effect["parameters"].items()}
    return {name: entry for name, entry in found.items() if entry.get("ci95") and entry.get("identifiable", True)}


def _list_effects(document: Mapping[str, Any]) -> list[str]:
    return [effect["name"] for effect in document.get("effects", [])]


def _get_version(document: Mapping[str, Any]) -> str:
    return str(document.get("provenance", {}).get("version", ""))


def _compare(name: str, older: Mapping[str, Any], newer: Mapping[str, Any]) -> ParameterChange:
    is_older_inside = newer["ci95"][0] <= older["value"] <= newer["ci95"][1]
    is_newer_inside = older["ci95"][0] <= newer["value"] <= older["ci95"][1]
    return ParameterChange(
        name=name,
        unit=newer["unit"],
        older=older["value"],
        older_ci95=older["ci95"],
        newer=newer["value"],
        newer_ci95=newer["ci95"],
        changed=not is_older_inside and not is_newer_inside,
    )

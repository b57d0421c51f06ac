"""Identified parameters of several runs side by side."""

from collections.abc import Mapping
from itertools import combinations
from typing import Any

from bench.comparison.document import ParameterDifference


def compare_parameters(fits: Mapping[str, Mapping[str, Any]]) -> tuple[ParameterDifference, ...]:
    """Return the parameters that at least two fits determine.

    Args:
        fits: fit documents by id of their run.
    """
    found: dict[str, dict[str, Mapping[str, Any]]] = {}
    for run, fit in fits.items():
        for name, entry in fit.get("parameters", {}).items():
            if entry.get("ci95") and entry.get("identifiable", True):
                found.setdefault(name, {})[run] = entry
    return tuple(_compare(name, entries) for name, entries in found.items() if len(entries) > 1)


def _compare(name: str, entries: Mapping[str, Mapping[str, Any]]) -> ParameterDifference:
    differs = any(
        not _contains(one, two) and not _contains(two, one) for one, two in combinations(entries.values(), 2)
    )
    return ParameterDifference(
        name=name,
        unit=next(iter(entries.values()))["unit"],
        values={run: entry["value"] for run, entry in entries.items()},
        ci95={run: (entry["ci95"][0], entry["ci95"][1]) for run, entry in entries.items()},
        differs=differs,
    )


def _contains(interval: Mapping[str, Any], value: Mapping[str, Any]) -> bool:
    return bool(interval["ci95"][0] <= value["value"] <= interval["ci95"][1])

"""Logs of the default simulated rig with one effect of a given size, for benchmarks of the diagnosis."""

import json
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path
from typing import Any

from bench.log import Identity
from bench.methods import Method, load_method
from bench.runs import run_from_plant
from identification.damper.effects import COMMON_EFFECTS, EFFECTS

NO_EFFECT = "nothing"
"""Name of the case without any effect."""


def make_scenario(effect: str, size: float) -> dict[str, Any]:
    """Return the shipped scenario of an effect with scaled sizes; lengths, speeds and times are kept.

    Args:
        effect: name of the effect, or ``NO_EFFECT``.
        size: factor on the shipped size [1].
    """
    if effect == NO_EFFECT:
        return {"schema": "mrbench.scenario/1", "description": "the default rig", "damper": "laboratory"}
    document: dict[str, Any] = json.loads(
        files("sim_rig.scenario").joinpath(f"library/{effect}.json").read_text("utf-8")
    )
    (entry,) = document["effects"]
    # Only a size may be zero; a length, speed or time may not.
    sizes = {q.symbol for q in EFFECTS[effect].find_form(entry.get("form")).parameters if q.low <= 0.0}
    entry["parameters"] = {k: v * size if k in sizes else v for k, v in entry["parameters"].items()}
    return document


def lengthen_method(name: str, times: int) -> Method:
    """Return a shipped method with a multiple of the cycles of each segment."""
    method = load_method(name)
    segments = tuple(
        s if s.cycles is None else s.model_copy(update={"cycles": times * s.cycles}) for s in method.segments
    )
    return method.model_copy(update={"segments": segments})


def record_effect(method: Method, effect: str, size: float, seed: int, log: Path) -> None:
    """Record a method on the simulated rig with an effect, unless the log exists."""
    if log.exists():
        return
    scenario = log.with_suffix(".scenario.json")
    scenario.write_text(json.dumps(make_scenario(effect, size)), encoding="utf-8")
    identity = Identity("", "", datetime.fromtimestamp(0, UTC))
    run_from_plant(method, str(scenario), log, identity, seed=seed)


__all__ = ["COMMON_EFFECTS", "NO_EFFECT", "lengthen_method", "make_scenario", "record_effect"]

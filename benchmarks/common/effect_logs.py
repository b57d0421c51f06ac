"""Logs of the default rig with one effect of a chosen size, for benchmarks of the diagnosis."""

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
    """The shipped scenario of an effect, with its sizes (not its lengths, speeds and times) times a factor.

    Args:
        effect: its name, or ``NOTHING``.
        size: factor on the shipped size [1].
    """
    if effect == NO_EFFECT:
        return {"schema": "mrbench.scenario/1", "description": "the default rig", "damper": "laboratory"}
    document: dict[str, Any] = json.loads(
        files("sim_rig.scenario").joinpath(f"library/{effect}.json").read_text("utf-8")
    )
    (entry,) = document["effects"]
    # What may be zero is a size; a length, a speed or a time may not.
    sizes = {q.symbol for q in EFFECTS[effect].find_form(entry.get("form")).parameters if q.low <= 0.0}
    entry["parameters"] = {k: v * size if k in sizes else v for k, v in entry["parameters"].items()}
    return document


def lengthen_method(name: str, times: int) -> Method:
    """A shipped method with so many times the cycles of each segment."""
    method = load_method(name)
    segments = tuple(
        s if s.cycles is None else s.model_copy(update={"cycles": times * s.cycles}) for s in method.segments
    )
    return method.model_copy(update={"segments": segments})


def record_effect(method: Method, effect: str, size: float, seed: int, log: Path) -> None:
    """Record a method on the rig with an effect, unless that log is there already."""
    if log.exists():
        return
    played = log.with_suffix(".scenario.json")
    played.write_text(json.dumps(make_scenario(effect, size)), encoding="utf-8")
    identity = Identity("", "", datetime.fromtimestamp(0, UTC))
    run_from_plant(method, str(played), log, identity, seed=seed)


__all__ = ["NO_EFFECT", "COMMON_EFFECTS", "record_effect", "make_scenario", "lengthen_method"]

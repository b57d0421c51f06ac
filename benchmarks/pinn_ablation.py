"""What each ingredient of the networks brings: leave it out, or give more of it, and look at the truth again.

python -m benchmarks.pinn_ablation                  all rows; takes an hour
python -m benchmarks.pinn_ablation weight rank      some of them
"""

import sys
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from benchmarks.pinn_cases import LABORATORY, Score, noisy_problem, try_out
from identification.pinn.settings import LayerSize, Level, LocalSettings, read_settings

SEEDS = (1, 3, 5)
_LOCAL = read_settings("local")
assert isinstance(_LOCAL, LocalSettings)
_FIRST, _LAST = _LOCAL.levels


class Row(NamedTuple):
    """One thing done otherwise."""

    group: str
    words: str
    changes: dict[str, object]
    preset: str = "local"
    motion: str = ""
    """How the motion of a displacement with noise is had; without one it is known."""


def _rows() -> Iterator[Row]:
    yield Row("slip", "as shipped: elements by the slip", {})
    yield Row("slip", "elements by the turns of the stroke", {"features": "stroke"})
    yield Row("slip", "elements by the slip, plain time in them", {"features": "time"})
    for activation in ("tanh", "sine", "gaussian"):
        yield Row("activation", activation, {"activation": activation})
    yield Row("network", "one network, all layers trained (global)", {}, preset="global")
    for meshes in (1, 2, 3, 10):
        levels = (_FIRST.model_copy(update={"meshes": min(meshes, 3)}), _last(meshes=meshes, settled=0.0))
        yield Row("meshes", f"{meshes} meshes at most in the last level", {"levels": levels})
    for rank in (16, 24, 36, 40, 48):
        size = LayerSize(units=max(120, 4 * rank), rank=rank, points=max(72, 2 * rank))
        yield Row("rank", f"rank {rank}", {"layers": (size,)})
    for units in (60, 80, 120, 160, 240):
        yield Row("units", f"{units} units, rank 40", {"layers": (LayerSize(units=units, rank=40, points=76),)})
    for weight in (5.0, 30.0, 100.0, 300.0):
        yield Row("weight", f"law weighed {weight:g}, no multipliers", _weighed(weight, 0))
    for weight in (5.0, 30.0, 100.0):
        for multipliers in (3, 6):
            words = f"law weighed {weight:g}, {multipliers} multiplier steps"
            yield Row("multipliers", words, _weighed(weight, multipliers))
    for motion in ("", "estimated", "by differences"):
        for residual in ("points", "means", "weak"):
            words = f"5 µm, motion {motion}" if motion else "known motion"
            yield Row("residual", f"{words}: {residual}", {"residual": residual}, motion=motion)
    yield Row("taking back", "blocks set aside stay aside", {"take_back": False})
    yield Row("paper", "derivative along the trajectory", {"derivative": "total"}, preset="paper")
    yield Row("paper", "derivative over the input t alone", {"derivative": "partial"}, preset="paper")


def _last(**changes: object) -> Level:
    return _LAST.model_copy(update=changes)


def _weighed(weight: float, multipliers: int) -> dict[str, object]:
    return {"levels": (_FIRST, _last(physics=weight)), "multipliers": multipliers, "layers": _LOCAL.layers[:1]}


def _score(row: Row, seed: int) -> Score:
    given = noisy_problem(seed, row.motion) if row.motion else None
    return try_out(row.preset, LABORATORY, seed, given=given, **row.changes)


def run(groups: tuple[str, ...] = ()) -> None:
    """Print a row for each."""
    print(f"  seeds {SEEDS}, six voltages: pooled error in Cramér-Rao deviations; unseen error over the truth's;")
    print("  validation error of the network's own force over the noise; median processor time")
    for row in _rows():
        if groups and row.group not in groups:
            continue
        scores = [_score(row, seed) for seed in SEEDS]
        pooled = "/".join(f"{s.pooled:.2g}" for s in scores)
        unseen = "/".join(f"{s.ratio:.4g}" for s in scores)
        own = "/".join(f"{s.reconstruction:.3g}" for s in scores)
        seconds = float(np.median([s.seconds for s in scores]))
        print(
            f"  {row.group:<12} {row.words:<45} {pooled:<18} {unseen:<26} {own:<18} {seconds:5.1f} s", flush=True
        )


if __name__ == "__main__":
    run(tuple(sys.argv[1:]))

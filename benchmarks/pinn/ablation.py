"""Ablation study of the networks: error against the truth with one part of the method changed or left out.

python -m benchmarks.pinn.ablation               all rows; takes an hour
python -m benchmarks.pinn.ablation weight rank   some groups of rows
"""

import sys
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from benchmarks.pinn.cases import LABORATORY, Score, make_noisy_problem, train_preset
from identification.pinn.common import ElementSettings, LayerSize, ScheduleStage, read_settings

SEEDS = (1, 3, 5)
_ELEMENTS = read_settings("elements")
assert isinstance(_ELEMENTS, ElementSettings)
_LAYERS = _ELEMENTS.layers
_FIRST_STAGE, _LAST_STAGE = _ELEMENTS.schedule


class Row(NamedTuple):
    """Variant of a preset with one change."""

    group: str
    description: str
    changes: dict[str, object]
    preset: str = "elements"
    motion: str = ""
    """Source of the motion if the displacement has noise; empty if the motion is known."""


def _list_rows() -> Iterator[Row]:
    yield Row("slip", "preset: elements between slip reversals", {})
    yield Row("slip", "elements between stroke reversals", {"element_input": "stroke"})
    yield Row("slip", "elements of the slip with plain time", {"element_input": "time"})
    for activation in ("tanh", "sine", "gaussian"):
        yield Row("activation", activation, {"activation": activation})
    yield Row("network", "one network, all layers trained (dense)", {}, preset="dense")
    for meshes in (1, 2, 3, 10):
        schedule = (
            _FIRST_STAGE.model_copy(update={"meshes": min(meshes, 3)}),
            _change_last_stage(meshes=meshes, reversal_tolerance=0.0),
        )
        yield Row("meshes", f"at most {meshes} meshes in the last stage", {"schedule": schedule})
    for rank in (16, 24, 36, 40, 48):
        size = LayerSize(units=max(120, 4 * rank), rank=rank, points=max(72, 2 * rank))
        yield Row("rank", f"rank {rank}", {"layers": (size,)})
    for units in (60, 80, 120, 160, 240):
        yield Row("units", f"{units} units, rank 40", {"layers": (LayerSize(units=units, rank=40, points=76),)})
    for weight in (5.0, 30.0, 100.0, 300.0):
        yield Row("weight", f"law weight {weight:g}, no multipliers", _set_law_weight(weight, 0))
    for weight in (5.0, 30.0, 100.0):
        for multipliers in (3, 6):
            description = f"law weight {weight:g}, {multipliers} multiplier steps"
            yield Row("multipliers", description, _set_law_weight(weight, multipliers))
    for motion in ("", "estimated", "by differences"):
        for weighting in ("collocation", "galerkin", "weak_form"):
            description = f"5 µm, motion {motion}: {weighting}" if motion else f"known motion: {weighting}"
            yield Row("residual", description, {"residual_weighting": weighting}, motion=motion)
    yield Row("refit", "no final fit on the validation blocks", {"refit_on_all": False})
    yield Row("paper", "derivative along the trajectory", {"derivative": "total"}, preset="paper")
    yield Row("paper", "partial derivative over the input t", {"derivative": "partial"}, preset="paper")


def _change_last_stage(**changes: object) -> ScheduleStage:
    return _LAST_STAGE.model_copy(update=changes)


def _set_law_weight(weight: float, multiplier_steps: int) -> dict[str, object]:
    return {
        "schedule": (_FIRST_STAGE, _change_last_stage(law_weight=weight)),
        "multiplier_steps": multiplier_steps,
        "layers": _LAYERS[:1],
    }


def _score_row(row: Row, seed: int) -> Score:
    problem = make_noisy_problem(seed, row.motion) if row.motion else None
    return train_preset(row.preset, LABORATORY, seed, problem=problem, changes=row.changes)


def run(groups: tuple[str, ...] = ()) -> None:
    """Print one row for each variant, or for those of the given groups."""
    print(f"  seeds {SEEDS}, six voltages: pooled error in Cramér-Rao deviations; validation error over that of")
    print("  the true damper; error of the network's own force over the noise; median processor time")
    for row in _list_rows():
        if groups and row.group not in groups:
            continue
        scores = [_score_row(row, seed) for seed in SEEDS]
        pooled = "/".join(f"{s.pooled_error:.2g}" for s in scores)
        ratios = "/".join(f"{s.ratio:.4g}" for s in scores)
        own_errors = "/".join(f"{s.reconstruction:.3g}" for s in scores)
        seconds = float(np.median([s.seconds for s in scores]))
        print(
            f"  {row.group:<12} {row.description:<45} {pooled:<18} {ratios:<26} {own_errors:<18} {seconds:5.1f} s",
            flush=True,
        )


if __name__ == "__main__":
    run(tuple(sys.argv[1:]))

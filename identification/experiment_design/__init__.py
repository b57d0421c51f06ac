"""Optimal experiment design: precision that planned strokes allow, and the stroke to add."""

from identification.experiment_design.assumed_damper import load_assumed_damper
from identification.experiment_design.design import assess_design
from identification.experiment_design.information import compute_coordinate_scales
from identification.experiment_design.planned_strokes import PlannedStrokes, read_planned_strokes

__all__ = [
    "PlannedStrokes",
    "assess_design",
    "compute_coordinate_scales",
    "load_assumed_damper",
    "read_planned_strokes",
]

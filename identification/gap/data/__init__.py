"""Cycles of a recording, held-out samples, data quality, and the residual on them."""

from identification.gap.data.block_evidence import bound_evidence, compute_evidence, count_independent_samples
from identification.gap.data.block_squares import compute_block_squares
from identification.gap.data.correlation import compute_correlation_length, compute_residual_correlation_length
from identification.gap.data.cycles import Cycles, Indices, split_by_piece
from identification.gap.data.error_square import ErrorSquare
from identification.gap.data.evaluation import EvaluationData
from identification.gap.data.quality import (
    check_cycle_count,
    check_sliding_recorded,
    describe_unobservable_effects,
)
from identification.gap.data.repeated_residual import estimate_repeated_residual
from identification.gap.data.residual_map import (
    Residual,
    compute_harmonics,
    estimate_drift,
    find_strongest_line,
    map_gap,
)
from identification.gap.data.scale_excess import estimate_scale_excess, measure_residual_scales
from identification.gap.data.shrinkage import NEAR_FLOOR_RATIO, Shrinkage, extend_to_other_strokes

__all__ = [
    "NEAR_FLOOR_RATIO",
    "Cycles",
    "ErrorSquare",
    "EvaluationData",
    "Indices",
    "Residual",
    "Shrinkage",
    "bound_evidence",
    "check_cycle_count",
    "check_sliding_recorded",
    "compute_block_squares",
    "compute_correlation_length",
    "compute_evidence",
    "compute_harmonics",
    "compute_residual_correlation_length",
    "count_independent_samples",
    "describe_unobservable_effects",
    "estimate_drift",
    "estimate_repeated_residual",
    "estimate_scale_excess",
    "extend_to_other_strokes",
    "find_strongest_line",
    "map_gap",
    "measure_residual_scales",
    "split_by_piece",
]

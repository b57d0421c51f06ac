"""Output-error fit of the damper model to recordings."""

from identification.fitting.budget import Budget, EffortMeter
from identification.fitting.damper_model import (
    DamperModel,
    make_damper_model,
    make_effect_entries,
    read_damper_model,
    read_fit_or_model,
)
from identification.fitting.dataset import Dataset, HoldOut, assemble
from identification.fitting.effect_model import EffectModel
from identification.fitting.force_channel import LowPass, compute_filter_delay
from identification.fitting.initial_guess import (
    ACCUMULATOR_SHARE,
    START_FIELD_RATE,
    START_N,
    START_RHO,
    estimate_least_damping,
    make_starting_points,
)
from identification.fitting.log_correction import PER_LOG_PARAMETERS, PerLogParameter
from identification.fitting.output_error import (
    Minimum,
    OptimiserSettings,
    fit_output_error,
    minimise,
    solve_bounded_step,
)
from identification.fitting.piece import Piece
from identification.fitting.prediction import (
    PiecePrediction,
    compute_drive_errors,
    compute_nrmse,
    compute_rmse,
    make_piece_model,
    predict_piece,
)
from identification.fitting.problem import (
    DELAY_LIMIT,
    Evaluation,
    Problem,
)
from identification.fitting.recording_scales import RecordingScales, measure_scales
from identification.fitting.search_space import SearchSpace
from identification.fitting.unknown_layout import COMMON_COUNT, COORDINATE_COUNT

__all__ = [
    "ACCUMULATOR_SHARE",
    "COMMON_COUNT",
    "COORDINATE_COUNT",
    "DELAY_LIMIT",
    "PER_LOG_PARAMETERS",
    "START_FIELD_RATE",
    "START_N",
    "START_RHO",
    "Budget",
    "DamperModel",
    "Dataset",
    "EffectModel",
    "EffortMeter",
    "Evaluation",
    "HoldOut",
    "LowPass",
    "Minimum",
    "OptimiserSettings",
    "PerLogParameter",
    "Piece",
    "PiecePrediction",
    "Problem",
    "RecordingScales",
    "SearchSpace",
    "assemble",
    "compute_drive_errors",
    "compute_filter_delay",
    "compute_nrmse",
    "compute_rmse",
    "estimate_least_damping",
    "fit_output_error",
    "make_damper_model",
    "make_effect_entries",
    "make_piece_model",
    "make_starting_points",
    "measure_scales",
    "minimise",
    "predict_piece",
    "read_damper_model",
    "read_fit_or_model",
    "solve_bounded_step",
]

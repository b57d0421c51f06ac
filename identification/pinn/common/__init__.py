"""Parts that all networks share: settings, inputs, law residuals, start, effects, results."""

from identification.pinn.common import law_residuals
from identification.pinn.common.activations import ACTIVATIONS, Activation
from identification.pinn.common.effect_terms import (
    EffectTerms,
    ResidualInputs,
    compute_effect_delay,
    compute_effect_deviations,
    is_supported,
)
from identification.pinn.common.initialisation import InitialStates, TrainingStart, generate_starts
from identification.pinn.common.inputs import PieceInputs
from identification.pinn.common.reconstruction import reconstruct_force
from identification.pinn.common.result import ForceErrors, PinnResult, TrainingOutcome, TrainingRecord
from identification.pinn.common.reversals import find_reversals
from identification.pinn.common.settings import (
    FEATURE_GROUPS,
    DenseSettings,
    ElementSettings,
    FeatureGroup,
    LayerSize,
    PaperSettings,
    PinnSettings,
    ResidualWeighting,
    ScheduleStage,
    read_settings,
    rename_preset,
)
from identification.pinn.common.states import Y_UNIT, Indices, SlipVelocity, States, TimeSpan
from identification.pinn.common.time_map import (
    TimeMap,
    make_default_map,
    make_linear_map,
    make_reversal_map,
    make_slip_times,
    make_step_map,
)
from identification.pinn.common.training_monitor import TrainingMonitor, TrainingStopped
from identification.pinn.common.training_pieces import (
    Batch,
    TrainingPiece,
    approximate_filters,
    make_training_pieces,
)
from identification.pinn.common.validation_split import make_validation_masks

__all__ = [
    "ACTIVATIONS",
    "FEATURE_GROUPS",
    "Y_UNIT",
    "Activation",
    "Batch",
    "DenseSettings",
    "EffectTerms",
    "ElementSettings",
    "FeatureGroup",
    "ForceErrors",
    "Indices",
    "InitialStates",
    "LayerSize",
    "PaperSettings",
    "PieceInputs",
    "PinnResult",
    "PinnSettings",
    "ResidualInputs",
    "ResidualWeighting",
    "ScheduleStage",
    "SlipVelocity",
    "States",
    "TimeMap",
    "TimeSpan",
    "TrainingMonitor",
    "TrainingOutcome",
    "TrainingPiece",
    "TrainingRecord",
    "TrainingStart",
    "TrainingStopped",
    "approximate_filters",
    "compute_effect_delay",
    "compute_effect_deviations",
    "find_reversals",
    "generate_starts",
    "is_supported",
    "law_residuals",
    "make_default_map",
    "make_linear_map",
    "make_reversal_map",
    "make_slip_times",
    "make_step_map",
    "make_training_pieces",
    "make_validation_masks",
    "read_settings",
    "reconstruct_force",
    "rename_preset",
]

"""Cases of the blind trial: random draw, strokes, sealed truth, folder."""

from sim_rig.trial.cases.draw import GRID_RATIOS, SampledCase, draw_cases, draw_grid, size_case
from sim_rig.trial.cases.folder import DiagnosisOutcome, Seal, TrialFolder, TrialKind
from sim_rig.trial.cases.parameter_values import ValueRange, compute_measures, draw_value, draw_values
from sim_rig.trial.cases.sizing import compute_noise_floor
from sim_rig.trial.cases.specimens import SIZES
from sim_rig.trial.cases.strokes import VARIANTS, RunKind, make_method_document, make_strokes
from sim_rig.trial.cases.truth import (
    CaseKind,
    Magnitude,
    MethodKind,
    SealedTruth,
    TrueCase,
    read_sealed_truth,
    write_sealed_truth,
)

__all__ = [
    "GRID_RATIOS",
    "SIZES",
    "VARIANTS",
    "CaseKind",
    "DiagnosisOutcome",
    "Magnitude",
    "MethodKind",
    "RunKind",
    "SampledCase",
    "Seal",
    "SealedTruth",
    "TrialFolder",
    "TrialKind",
    "TrueCase",
    "ValueRange",
    "compute_measures",
    "compute_noise_floor",
    "draw_cases",
    "draw_grid",
    "draw_value",
    "draw_values",
    "make_method_document",
    "make_strokes",
    "read_sealed_truth",
    "size_case",
    "write_sealed_truth",
]

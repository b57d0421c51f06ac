"""Joint fits of the law and a set of effects."""

from identification.gap.fits.candidate import EXPLAINED_RATIO, NO_GAP_RATIO, Candidate
from identification.gap.fits.effect_unknowns import (
    insert_effect_unknowns,
    remove_effect_unknowns,
    replace_effect_unknowns,
)
from identification.gap.fits.fit_options import FitOptions
from identification.gap.fits.joint_fit import JointFit, fit_jointly, refit_all_samples
from identification.gap.fits.joint_step import predict_joint_step, take_joint_step

__all__ = [
    "EXPLAINED_RATIO",
    "NO_GAP_RATIO",
    "Candidate",
    "FitOptions",
    "JointFit",
    "fit_jointly",
    "insert_effect_unknowns",
    "predict_joint_step",
    "refit_all_samples",
    "remove_effect_unknowns",
    "replace_effect_unknowns",
    "take_joint_step",
]

"""Bayesian optimisation of the networks' settings."""

from identification.tuning.study import StudyRequest, get_best_settings, run_study
from identification.tuning.summary import compute_importances, format_summary, write_plot

__all__ = [
    "StudyRequest",
    "compute_importances",
    "format_summary",
    "get_best_settings",
    "run_study",
    "write_plot",
]

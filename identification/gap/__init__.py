"""Diagnosis of the gap between law and recordings of a damper: the missing effects and their probabilities."""

from identification.gap.diagnosis import diagnose, make_diagnosis_problem
from identification.gap.trend import analyse_trend

__all__ = [
    "analyse_trend",
    "diagnose",
    "make_diagnosis_problem",
]

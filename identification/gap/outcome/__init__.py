"""Results of a diagnosis: verdict, explanation, twin, next stroke and cross-check."""

from identification.gap.outcome.cross_check import cross_check_effects
from identification.gap.outcome.diagnosis_result import DiagnosisResult
from identification.gap.outcome.explanation import suggest_check, summarise_diagnosis, tabulate_diagnoses
from identification.gap.outcome.report import ReportBuilder

__all__ = [
    "DiagnosisResult",
    "ReportBuilder",
    "cross_check_effects",
    "suggest_check",
    "summarise_diagnosis",
    "tabulate_diagnoses",
]

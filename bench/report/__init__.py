"""Reports: one page with plots from a log, a fit and a diagnosis, which are all read as files."""

from bench.report.diagnosis import VERDICTS, read_diagnosis
from bench.report.documents import Fit, Prediction, read_fit, read_prediction
from bench.report.layout import save_figures
from bench.report.page import gather, make_figures, render
from bench.report.truth import Truth, judge, make_answer_rows, make_truth_rows, read_truth
from bench.report.values import format_force, format_percent, format_quantity, format_ratio

__all__ = [
    "VERDICTS",
    "Fit",
    "Prediction",
    "Truth",
    "format_force",
    "format_percent",
    "format_quantity",
    "format_ratio",
    "gather",
    "judge",
    "make_answer_rows",
    "make_figures",
    "make_truth_rows",
    "read_diagnosis",
    "read_fit",
    "read_prediction",
    "read_truth",
    "render",
    "save_figures",
]

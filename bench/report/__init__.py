"""Reports: one page with plots from a log, a fit and a diagnosis, which are all read as files."""

from bench.report.diagnosis import VERDICTS, read_diagnosis
from bench.report.documents import (
    DocumentPart,
    Estimate,
    Fit,
    Prediction,
    read_document,
    read_fit,
    read_prediction,
)
from bench.report.drawing import FAINT_COLOUR, INK_COLOUR, make_figure, style_axes
from bench.report.layout import save_figures
from bench.report.page import gather, make_figures, render
from bench.report.summary import Finding
from bench.report.truth import Truth, judge, make_answer_rows, make_truth_rows, read_truth
from bench.report.values import (
    format_force,
    format_name,
    format_percent,
    format_quantity,
    format_ratio,
    format_significant,
    format_unit,
)

__all__ = [
    "FAINT_COLOUR",
    "INK_COLOUR",
    "VERDICTS",
    "DocumentPart",
    "Estimate",
    "Finding",
    "Fit",
    "Prediction",
    "Truth",
    "format_force",
    "format_name",
    "format_percent",
    "format_quantity",
    "format_ratio",
    "format_significant",
    "format_unit",
    "gather",
    "judge",
    "make_answer_rows",
    "make_figure",
    "make_figures",
    "make_truth_rows",
    "read_diagnosis",
    "read_document",
    "read_fit",
    "read_prediction",
    "read_truth",
    "render",
    "save_figures",
    "style_axes",
]

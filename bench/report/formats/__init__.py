"""Reports as files: page, PDF, and a workbook with raw and derived values."""

from bench.report.formats.derived import QUANTITIES, StrokeValues, derive_strokes
from bench.report.formats.saving import REPORT_FORMATS, ReportFormat, ReportWriter

__all__ = [
    "QUANTITIES",
    "REPORT_FORMATS",
    "ReportFormat",
    "ReportWriter",
    "StrokeValues",
    "derive_strokes",
]

"""A report as a file in the format that its name ends with."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias, get_args

from bench.report.formats.pdf import write_pdf
from bench.report.formats.workbook import write_workbook
from bench.report.page import Report, make_context, make_pictures, render

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ReportFormat: TypeAlias = Literal["html", "pdf", "xlsx"]
REPORT_FORMATS: tuple[ReportFormat, ...] = get_args(ReportFormat)


class ReportWriter:
    """Writer of one report in any format; the plots are drawn once."""

    def __init__(self, report: Report, figures: dict[str, Figure], command: str, created_at: datetime) -> None:
        """Take a report.

        Args:
            report: content.
            figures: plots, from `make_figures`; a workbook needs none.
            command: command line that writes it.
            created_at: time at which it is written.
        """
        self._report, self._figures = report, figures
        self._command, self._created_at = command, created_at

    def write(self, report_format: ReportFormat, path: Path) -> None:
        """Write the report to a file.

        Raises:
            ReportError: the file cannot be written.
        """
        writers: dict[ReportFormat, Callable[[Path], object]] = {
            "html": self._write_html,
            "pdf": self._write_pdf,
            "xlsx": self._write_workbook,
        }
        writers[report_format](path)

    def _write_html(self, path: Path) -> None:
        page = render(self._report, self._figures, self._command, self._created_at)
        path.write_text(page, encoding="utf-8")

    def _write_pdf(self, path: Path) -> None:
        context = make_context(self._report, self._command, self._created_at)
        write_pdf(context, make_pictures(self._figures), path)

    def _write_workbook(self, path: Path) -> None:
        context = make_context(self._report, self._command, self._created_at)
        write_workbook(context, self._report.log, self._report.fit, self._report.diagnosis, path)

"""Report as PDF, with the texts, tables and plots of the page."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

from fpdf import FPDF
from fpdf.enums import XPos, YPos
from fpdf.fonts import FontFace
from matplotlib import get_data_path

from bench.errors import ReportError

_FONT = "DejaVu"
_FONT_FILES = {"": "DejaVuSans.ttf", "B": "DejaVuSans-Bold.ttf"}
"""Fonts of matplotlib, which has all symbols of a report."""
_MARGIN, _LINE = 16.0, 4.6
"""[mm]"""
_TEXT_SIZE, _TABLE_SIZE, _HEADING_SIZE, _TITLE_SIZE = 9, 8, 13, 19
"""[pt]"""
_HEAD_STYLE = FontFace(emphasis="BOLD", fill_color=(232, 236, 240))
_PROPERTY_WIDTHS = (2, 5)


@dataclass(frozen=True)
class Table:
    """Table with a header; without one, rows of name and value."""

    rows: Sequence[Sequence[str]]
    header: Sequence[str] = ()
    widths: Sequence[float] = _PROPERTY_WIDTHS


@dataclass(frozen=True)
class Section:
    """One section of the document."""

    title: str
    texts: Sequence[str] = ()
    tables: Sequence[Table] = ()
    pictures: Sequence[str] = field(default=())
    """Names of the plots."""


class _Document(FPDF):
    """A4 pages with the title and the number at the foot."""

    def __init__(self, title: str) -> None:
        super().__init__(format="A4")
        self.set_title(f"{title} – damper report")
        self.set_creator("mrbench")
        self.set_lang("en")
        for style, name in _FONT_FILES.items():
            self.add_font(_FONT, style, Path(get_data_path()) / "fonts" / "ttf" / name)
        self.set_margin(_MARGIN)
        self.set_auto_page_break(True, margin=_MARGIN + 4)
        self.foot = f"{title} – damper report"

    def footer(self) -> None:
        """Write title and page number."""
        self.set_y(-_MARGIN)
        self.set_font(_FONT, size=_TABLE_SIZE)
        self.cell(0, _LINE, f"{self.foot}, page {self.page_no()} of {{nb}}", align="R")


def write_pdf(context: Mapping[str, Any], pictures: Mapping[str, tuple[str, str, bytes]], path: Path) -> None:
    """Write a report.

    Args:
        context: values of the page's template.
        pictures: title, caption and PNG of each plot by its name.
        path: file to write.

    Raises:
        ReportError: the file cannot be written.
    """
    document = _Document(str(context["title"]))
    document.add_page()
    _write_text(document, str(context["title"]), _TITLE_SIZE, bold=True)
    for section in _list_sections(context):
        _write_section(document, section, pictures)
    try:
        document.output(str(path))
    except OSError as error:
        raise ReportError(f"{path}: {(error.strerror or str(error)).lower()}") from error


def _list_sections(context: Mapping[str, Any]) -> Iterator[Section]:
    """Yield the sections in the order of the page."""
    yield Section("The run", tables=[Table(context["run"])])
    yield _make_summary(context)
    if context["diagnosis"]:
        yield _make_diagnosis(context["diagnosis"])
    if context["truth"]:
        truth = context["truth"]
        yield Section("The hidden effect, disclosed", [truth["judgement"].text], [Table(truth["rows"])])
    yield Section("", pictures=["discovery", "loops", "time", "residual"])
    if context["fit"]:
        yield from _make_fit_sections(context["fit"])
    channels = Table(context["channels"], ("Channel", "Unit", "Rate", "Filter", "Delay"), (2, 1, 1, 3, 1))
    yield Section("The recording", tables=[Table(context["outcome"]), channels], pictures=["recording"])
    origin = f"Created {context['created_at']} with mrbench {context['version']}: {context['command']}"
    made_by = [Table(context["fit"]["provenance"])] if context["fit"] else []
    yield Section("Provenance", [origin], made_by)


def _make_summary(context: Mapping[str, Any]) -> Section:
    figures = context["fit"]["key_figures"] if context["fit"] else []
    tables = [Table([(name, value) for value, name in figures])] if figures else []
    return Section("Summary", [f"• {finding.text}" for finding in context["findings"]], tables)


def _make_diagnosis(diagnosis: Mapping[str, Any]) -> Section:
    effects = [
        (row.name, row.stage, "\n".join(row.values), row.share, row.probability) for row in diagnosis["effects"]
    ]
    tables = [
        Table(diagnosis["gap"]),
        Table(
            effects, ("Effect", "Stage", "Size, 95 % interval", "Share of the gap", "Probability"), (2, 2, 4, 2, 2)
        ),
        Table([("Explanation", "Probability"), *diagnosis["sets"]]),
    ]
    outside = diagnosis["discovery"]["text"] if diagnosis["discovery"] else ""
    following = f"Proposed next stroke: a {diagnosis['next']}" if diagnosis["next"] else ""
    texts = [f"{diagnosis['verdict']} {diagnosis['explanation']}", outside, following, diagnosis["cross_check"]]
    pictures = ["gap", "where"]
    return Section("Diagnosis of the sim-to-real gap", [*texts, *diagnosis["notes"]], tables, pictures)


def _make_fit_sections(fit: Mapping[str, Any]) -> Iterator[Section]:
    drives = [
        (row.drive, row.rmse, row.over_floor, row.nrmse, str(row.samples), row.note) for row in fit["drives"]
    ]
    header = ("Drive", "RMSE", "Over the floor", "NRMSE", "Samples", "")
    errors = Table(fit["errors"], ("The fit on its recordings", "RMSE", "NRMSE"), (2, 1, 1))
    tables = [Table(drives, header, (1, 1, 1, 1, 1, 1)), errors]
    yield Section("Force error by drive", tables=tables, pictures=["drives"])
    names = ("Parameter", "Value, 95 % interval", "Unit", "Meaning, certainty")
    for title, form in (
        ("Regular coordinates", "coordinates"),
        ("The modified Bouc-Wen parameters", "parameters"),
    ):
        rows = [
            (row.name, row.value, row.unit, ", ".join(filter(None, (row.meaning, row.certainty, row.note))))
            for row in fit[form]
        ]
        yield Section(title, tables=[Table(rows, names, (1, 2, 1, 4))])
    pairs = fit["correlations"] or [("Strongly correlated pairs", "none beyond ±0.9")]
    yield Section("Uncertainty", tables=[Table(fit["floor"]), Table(fit["nuisances"]), Table(pairs)])


def _write_section(document: _Document, section: Section, pictures: Mapping[str, tuple[str, str, bytes]]) -> None:
    if section.title:
        document.start_section(section.title)
        document.ln(3)
        _write_text(document, section.title, _HEADING_SIZE, bold=True)
    for text in filter(None, section.texts):
        _write_text(document, str(text), _TEXT_SIZE)
    for table in section.tables:
        if table.rows:
            _write_table(document, table)
    _write_pictures(document, [pictures[name] for name in section.pictures if name in pictures])


def _write_text(document: _Document, text: str, size: int, *, bold: bool = False) -> None:
    document.set_font(_FONT, "B" if bold else "", size)
    document.multi_cell(0, size * 0.5, text, new_x=XPos.LMARGIN, new_y=YPos.NEXT)
    document.ln(1.5)


def _write_table(document: _Document, table: Table) -> None:
    document.set_font(_FONT, size=_TABLE_SIZE)
    lines = [table.header, *table.rows] if table.header else table.rows
    with document.table(
        col_widths=tuple(table.widths),
        line_height=_LINE,
        first_row_as_headings=bool(table.header),
        headings_style=_HEAD_STYLE,
        text_align="LEFT",
        borders_layout="HORIZONTAL_LINES",
    ) as made:
        for line in lines:
            row = made.row()
            for cell in line:
                row.cell(str(cell))
    document.ln(3)


def _write_pictures(document: _Document, pictures: Iterable[tuple[str, str, bytes]]) -> None:
    for title, caption, data in pictures:
        _write_text(document, title, _TEXT_SIZE + 1, bold=True)
        document.image(BytesIO(data), w=document.epw, alt_text=title)
        _write_text(document, caption, _TABLE_SIZE)

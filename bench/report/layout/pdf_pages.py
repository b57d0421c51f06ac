"""Pages of a PDF: A4, with title and number at the foot; texts, tables and plots on them."""

from collections.abc import Iterable, Mapping
from io import BytesIO
from pathlib import Path

from fpdf import FPDF
from fpdf.enums import XPos, YPos
from fpdf.fonts import FontFace
from matplotlib import get_data_path

from bench.report.layout.sections import Section, Table
from bench.report.layout.template import Picture

_FONT = "DejaVu"
_FONT_FILES = {"": "DejaVuSans.ttf", "B": "DejaVuSans-Bold.ttf"}
"""Fonts of matplotlib, which has all symbols of a report."""
_MARGIN, _LINE = 16.0, 4.6
"""[mm]"""
_KEPT_HEIGHT = 30.0
"""[mm] Smallest height below a caption on the same page."""
_TEXT_SIZE, _TABLE_SIZE, _HEADING_SIZE, _TITLE_SIZE = 9, 8, 13, 19
"""[pt]"""
_HEAD_STYLE = FontFace(emphasis="BOLD", fill_color=(232, 236, 240))


class _Document(FPDF):
    """A4 pages with the title and the number at the foot."""

    def __init__(self, title: str, kind: str) -> None:
        super().__init__(format="A4")
        self.foot = f"{title} – {kind}"
        self.set_title(self.foot)
        self.set_creator("mrbench")
        self.set_lang("en")
        for style, name in _FONT_FILES.items():
            self.add_font(_FONT, style, Path(get_data_path()) / "fonts" / "ttf" / name)
        self.set_margin(_MARGIN)
        self.set_auto_page_break(True, margin=_MARGIN + 4)

    def footer(self) -> None:
        """Write title and page number."""
        self.set_y(-_MARGIN)
        self.set_font(_FONT, size=_TABLE_SIZE)
        self.cell(0, _LINE, f"{self.foot}, page {self.page_no()} of {{nb}}", align="R")


def make_pages(title: str, kind: str, sections: Iterable[Section], pictures: Mapping[str, Picture]) -> FPDF:
    """Return the document that `write_document` writes."""
    document = _Document(title, kind)
    document.add_page()
    _write_text(document, title, _TITLE_SIZE, bold=True)
    for section in sections:
        _write_section(document, section, pictures)
    return document


def _write_section(document: _Document, section: Section, pictures: Mapping[str, Picture]) -> None:
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
    if table.caption:
        if document.will_page_break(_KEPT_HEIGHT):
            document.add_page()
        _write_text(document, table.caption, _TEXT_SIZE, bold=True)
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


def _write_pictures(document: _Document, pictures: Iterable[Picture]) -> None:
    for picture in pictures:
        _write_text(document, picture.title, _TEXT_SIZE + 1, bold=True)
        document.image(BytesIO(picture.content), w=picture.width * document.epw, alt_text=picture.title)
        _write_text(document, picture.caption, _TABLE_SIZE)

"""Layout of reports as pages and PDF documents: templates, styles, sections, tables and plots."""

from bench.report.layout.figures import render_png, save_figures
from bench.report.layout.pdf_document import write_document
from bench.report.layout.sections import Section, Table
from bench.report.layout.template import Picture, make_environment

__all__ = ["Picture", "Section", "Table", "make_environment", "render_png", "save_figures", "write_document"]

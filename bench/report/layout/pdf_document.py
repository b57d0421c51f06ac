"""PDF with sections of texts, tables and plots, on A4 pages with title and number at the foot."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from bench.errors import ReportError
from bench.report.layout.sections import Section
from bench.report.layout.template import Picture


def write_document(
    title: str, kind: str, sections: Iterable[Section], pictures: Mapping[str, Picture], path: Path
) -> None:
    """Write a PDF.

    Args:
        title: title of the document.
        kind: kind of report, such as ``damper report``; part of the title at the foot.
        sections: sections in their order.
        pictures: plots by the names that the sections use.
        path: file to write.

    Raises:
        ReportError: the file cannot be written.
    """
    # Only here: service and worker import this module at once, and write no PDF.
    from bench.report.layout.pdf_pages import make_pages

    document = make_pages(title, kind, sections, pictures)
    try:
        document.output(str(path))
    except OSError as error:
        raise ReportError(f"{path}: {(error.strerror or str(error)).lower()}") from error

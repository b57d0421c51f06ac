"""Sections and tables of a document, whatever its format."""

from collections.abc import Sequence
from dataclasses import dataclass, field

_PROPERTY_WIDTHS = (2, 5)


@dataclass(frozen=True)
class Table:
    """Table with a header; without one, rows of name and value."""

    rows: Sequence[Sequence[str]]
    header: Sequence[str] = ()
    widths: Sequence[float] = _PROPERTY_WIDTHS
    """Widths of the columns, relative to each other; each column of a PDF needs one."""
    caption: str = ""


@dataclass(frozen=True)
class Section:
    """One section of the document."""

    title: str
    texts: Sequence[str] = ()
    tables: Sequence[Table] = ()
    pictures: Sequence[str] = field(default=())
    """Names of the plots."""

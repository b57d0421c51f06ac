"""Conditions of a search in PostgreSQL, which read the indices and the table of the newest results."""

from sqlalchemy import ColumnElement, Double, Text, any_, column, func, literal_column, or_, select, table
from sqlalchemy.dialects.postgresql import ARRAY

from bench.catalogue.models import NoteRow, RunRow

_ESCAPE = "/"
_VALUES = table(
    "newest_values",
    column("run_id", Text),
    column("kind", Text),
    column("name", Text),
    column("value", Double),
)
"""Effects of the newest diagnosis and parameters of the newest fit of each run, kept by a trigger."""
_TEXTS: ColumnElement[str] = literal_column("runs.texts", Text)
"""Specimen, method, operator and reason of a run in small letters, kept by the server."""


def contains_text(text: str) -> ColumnElement[bool]:
    """Return the condition that a run or one of its notes contains a text, in any case."""
    notes = select(NoteRow.run_id).where(NoteRow.text.icontains(text, autoescape=True)).scalar_subquery()
    # As an array: only then can the server use the indices of both sides of an alternative.
    noted = any_(func.array(notes, type_=ARRAY(Text)))
    return or_(_TEXTS.contains(func.lower(_escape(text)), escape=_ESCAPE), RunRow.id == noted)


def _escape(text: str) -> str:
    """Return a text in which no character stands for others in a pattern."""
    for sign in (_ESCAPE, "%", "_"):
        text = text.replace(sign, _ESCAPE + sign)
    return text


def has_newest_value(
    kind: str, name: str, least: float | None = None, most: float | None = None
) -> ColumnElement[bool]:
    """Return the condition that the newest result of a kind has a value, which may have to be in a range.

    Args:
        kind: kind of the job.
        name: effect or parameter.
        least: smallest value; None for any.
        most: largest value; None for any.
    """
    query = select(_VALUES.c.run_id).where(_VALUES.c.kind == kind, _VALUES.c.name == name)
    if least is not None:
        query = query.where(_VALUES.c.value >= least)
    if most is not None:
        query = query.where(_VALUES.c.value <= most)
    return RunRow.id.in_(query)

"""Selection of runs by facts of the run and by results of its newest fit and diagnosis."""

import json
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import ColumnElement, Text, cast, exists, or_, select
from sqlalchemy.orm import aliased

from bench.catalogue.database import POSTGRES
from bench.catalogue.indexed_search import contains_text, has_newest_value
from bench.catalogue.models import JobRow, NoteRow, RunOutcome, RunRow
from bench.endings import RunEnding

_SEARCHED = (RunRow.specimen, RunRow.method, RunRow.operator, RunRow.reason)
"""Columns that are searched for a text; PostgreSQL keeps them together in one column."""


@dataclass(frozen=True)
class RunFilter:
    """Selection of runs; None selects all. All given conditions have to be met."""

    specimen: str | None = None
    bench: str | None = None
    method: str | None = None
    outcome: RunOutcome | None = None
    ending: RunEnding | None = None
    started_from: datetime | None = None
    """Earliest start."""
    started_to: datetime | None = None
    """Start before which a run has to begin."""
    effect: str | None = None
    """Effect that the newest diagnosis names."""
    parameter: str | None = None
    """Parameter of the newest fit that has to be in the range, in the unit of the fit document."""
    parameter_min: float | None = None
    parameter_max: float | None = None
    text: str | None = None
    """Text in specimen, method, operator, reason, tags or notes, in any case."""
    tag: str | None = None
    """Tag that the run has, exactly."""
    is_trashed: bool = False
    """Runs in the trash instead of all others."""

    def make_conditions(self, database: str) -> list[ColumnElement[bool]]:
        """Return the conditions of a query for the selected runs.

        Args:
            database: kind of the database, as SQLAlchemy calls its dialect.
        """
        given: list[ColumnElement[bool] | None] = [
            RunRow.trashed.is_not(None) if self.is_trashed else RunRow.trashed.is_(None),
            None if self.specimen is None else RunRow.specimen == self.specimen,
            None if self.bench is None else RunRow.bench == self.bench,
            None if self.method is None else RunRow.method == self.method,
            None if self.outcome is None else RunRow.outcome == self.outcome,
            None if self.ending is None else RunRow.ending == self.ending,
            None if self.started_from is None else RunRow.started >= self.started_from,
            None if self.started_to is None else RunRow.started < self.started_to,
        ]
        given += self._search_indices() if database == POSTGRES else self._search_documents()
        return [condition for condition in given if condition is not None]

    def _search_documents(self) -> list[ColumnElement[bool] | None]:
        return [
            None if self.text is None else _contains(self.text),
            None if self.tag is None else _has_tag(self.tag),
            None if self.effect is None else _names_effect(self.effect),
            None if self.parameter is None else self._is_in_range(self.parameter),
        ]

    def _search_indices(self) -> list[ColumnElement[bool] | None]:
        least, most = self.parameter_min, self.parameter_max
        return [
            None if self.text is None else contains_text(self.text),
            None if self.tag is None else _has_tag(self.tag),
            None if self.effect is None else has_newest_value("diagnose", self.effect),
            None if self.parameter is None else has_newest_value("identify", self.parameter, least, most),
        ]

    def _is_in_range(self, name: str) -> ColumnElement[bool]:
        value = JobRow.summary[("parameters", name)].as_float()
        conditions = [value.is_not(None)]
        if self.parameter_min is not None:
            conditions.append(value >= self.parameter_min)
        if self.parameter_max is not None:
            conditions.append(value <= self.parameter_max)
        return _newest_result("identify", *conditions)


def _contains(text: str) -> ColumnElement[bool]:
    found = (column.icontains(text, autoescape=True) for column in _SEARCHED)
    is_in_note = NoteRow.text.icontains(text, autoescape=True)
    return or_(*found, exists().where(NoteRow.run_id == RunRow.id, is_in_note))


def _has_tag(tag: str) -> ColumnElement[bool]:
    # As the column stores it, with the quotes that no tag contains.
    return cast(RunRow.tags, Text).contains(json.dumps(tag), autoescape=True)


def _names_effect(name: str) -> ColumnElement[bool]:
    # Names of effects contain neither quotes nor backslashes, so that their text in the JSON list is unique.
    effects = cast(JobRow.summary["effects"], Text)
    return _newest_result("diagnose", effects.contains(f'"{name}"', autoescape=True))


def _newest_result(kind: str, *conditions: ColumnElement[bool]) -> ColumnElement[bool]:
    """Return the condition that the newest result of a kind meets conditions; older results do not count."""
    newer = aliased(JobRow)
    newest = (
        select(newer.id)
        .where(newer.run_id == RunRow.id, newer.kind == kind, newer.state == "done")
        .order_by(newer.finished.desc(), newer.id.desc())
        .limit(1)
        .correlate(RunRow)
        .scalar_subquery()
    )
    return exists().where(JobRow.id == newest, *conditions)

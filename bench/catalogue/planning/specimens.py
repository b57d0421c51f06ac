"""Specimens: the serial numbers in the runs, and what people have written about them."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import JSON, Engine, Select, Text, func, or_, select, union
from sqlalchemy.orm import Mapped, mapped_column, sessionmaker

from bench.catalogue.models import Base, RunRow, UtcTime


class SpecimenRow(Base):
    """Description of one specimen; a serial number in a run needs none."""

    __tablename__ = "specimens"

    serial: Mapped[str] = mapped_column(Text, primary_key=True)
    description: Mapped[str] = mapped_column(Text, default="")
    damper_kind: Mapped[str] = mapped_column(Text, default="")
    """Kind of the damper, such as its type number."""
    drive_kind: Mapped[str | None] = mapped_column(Text, default=None)
    """Quantity that may drive it; None if it is not known."""
    limits: Mapped[dict[str, float]] = mapped_column(JSON, default=dict)
    """Known limits by the names of a method's limits."""
    registered: Mapped[datetime] = mapped_column(UtcTime)
    """UTC of the first description."""
    revision: Mapped[int] = mapped_column(default=1)
    """Number of descriptions so far."""


@dataclass(frozen=True)
class Specimen:
    """A specimen with its description, if there is one, and the extent of its runs."""

    serial: str
    row: SpecimenRow | None
    runs: int
    last_run: datetime | None

    @property
    def revision(self) -> int:
        """Number of descriptions so far; 0 for a serial number that only runs name."""
        return 0 if self.row is None else self.row.revision


class SpecimenStore:
    """Specimens in the database of a catalogue; safe from any thread."""

    def __init__(self, engine: Engine) -> None:
        """Use an open database."""
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def list_specimens(self, limit: int, after: str = "", text: str = "") -> Sequence[Specimen]:
        """Return specimens in the order of their serial numbers.

        Args:
            limit: largest number of specimens.
            after: return only specimens that come after this serial number.
            text: text in serial number, description or kind; empty for all.
        """
        query, serial = _select_specimens()
        if after:
            query = query.where(serial > after)
        if text:
            columns = (serial, SpecimenRow.description, SpecimenRow.damper_kind)
            query = query.where(or_(*(column.icontains(text, autoescape=True) for column in columns)))
        with self._sessions() as session:
            return [Specimen(*row) for row in session.execute(query.order_by(serial).limit(limit))]

    def find(self, serial: str) -> Specimen | None:
        """Return the specimen with a serial number; None if neither a run nor a person has named it."""
        query, column = _select_specimens()
        with self._sessions() as session:
            row = session.execute(query.where(column == serial)).first()
            return None if row is None else Specimen(*row)

    def describe(self, serial: str, revision: int, values: dict[str, Any]) -> bool:
        """Set columns of a specimen.

        Args:
            serial: serial number.
            revision: number of descriptions that the author has seen; 0 adds the first one.
            values: value by column.

        Returns:
            False if another description was written meanwhile; nothing was changed then.
        """
        with self._sessions.begin() as session:
            row = session.get(SpecimenRow, serial, with_for_update=True)
            if (0 if row is None else row.revision) != revision:
                return False
            if row is None:
                row = SpecimenRow(serial=serial, registered=datetime.now(UTC), revision=0)
                session.add(row)
            for name, value in values.items():
                setattr(row, name, value)
            row.revision += 1
            return True

    def list_runs(self, serial: str, limit: int) -> Sequence[RunRow]:
        """Return the newest runs of a specimen with a complete log, oldest first."""
        query = select(RunRow).where(
            RunRow.specimen == serial, RunRow.log_sha256.is_not(None), RunRow.trashed.is_(None)
        )
        with self._sessions() as session:
            newest = session.scalars(query.order_by(RunRow.started.desc(), RunRow.id.desc()).limit(limit)).all()
            return newest[::-1]


def _select_specimens() -> tuple[Select[Any], Any]:
    """Return the query for all specimens, and its column of serial numbers; runs in the trash do not count."""
    named = (RunRow.specimen != "") & RunRow.trashed.is_(None)
    serials = union(select(SpecimenRow.serial), select(RunRow.specimen.label("serial")).where(named)).subquery()
    runs = (
        select(RunRow.specimen, func.count().label("number"), func.max(RunRow.started).label("last"))
        .where(named)
        .group_by(RunRow.specimen)
        .subquery()
    )
    query = (
        select(serials.c.serial, SpecimenRow, func.coalesce(runs.c.number, 0), runs.c.last)
        .outerjoin(SpecimenRow, SpecimenRow.serial == serials.c.serial)
        .outerjoin(runs, runs.c.specimen == serials.c.serial)
    )
    return query, serials.c.serial

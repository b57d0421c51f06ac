"""Tables of the catalogue: runs and the jobs on them."""

from datetime import UTC, datetime
from typing import Any, Literal, TypeAlias, get_args

from sqlalchemy import JSON, BigInteger, DateTime, Dialect, Enum, ForeignKey, Index, Text
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column
from sqlalchemy.types import TypeDecorator

RunState: TypeAlias = Literal["running", "ended", "cut_off"]
"""cut_off: the log has no end and nobody writes to it any more."""
RunOutcome: TypeAlias = Literal["clean", "lossy", "truncated", "incomplete"]
JobState: TypeAlias = Literal["queued", "running", "done", "failed", "cancelled"]
UNFINISHED: tuple[JobState, ...] = ("queued", "running")
"""States of a job that a worker still owes an answer."""


class UtcTime(TypeDecorator[datetime]):
    """A time that is UTC on both sides, also in databases that keep no time zone."""

    impl = DateTime
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """To the database: UTC without its mark."""
        return None if value is None else value.astimezone(UTC).replace(tzinfo=None)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """From the database: marked as UTC."""
        return None if value is None else value.replace(tzinfo=UTC)


def _words(of: Any) -> Enum:
    """A column that holds one of some words, kept as text without a constraint, so that words may be added."""
    return Enum(*get_args(of), native_enum=False, create_constraint=False, length=16)


class Base(DeclarativeBase):
    """Ground of all tables."""


class RunRow(Base):
    """One run and its log."""

    __tablename__ = "runs"
    __table_args__ = (Index("runs_newest_first", "started", "id"),)

    id: Mapped[str] = mapped_column(Text, primary_key=True)
    method: Mapped[str] = mapped_column(Text)
    specimen: Mapped[str] = mapped_column(Text, default="")
    operator: Mapped[str] = mapped_column(Text, default="")
    source: Mapped[str] = mapped_column(Text, default="run")
    """``run``, or ``import`` for a recording made elsewhere."""
    started: Mapped[datetime] = mapped_column(UtcTime)
    """UTC; of an import that does not say, when its log was written."""
    duration_s: Mapped[float | None] = mapped_column(default=None)
    """[s] recorded; while the run goes on, planned."""
    state: Mapped[RunState] = mapped_column(_words(RunState), index=True)
    outcome: Mapped[RunOutcome | None] = mapped_column(_words(RunOutcome), default=None)
    reason: Mapped[str] = mapped_column(Text, default="")
    """Why the outcome is not clean."""
    log: Mapped[str] = mapped_column(Text, unique=True)
    """From the data folder, or absolute where it lies elsewhere."""
    log_bytes: Mapped[int | None] = mapped_column(BigInteger, default=None)
    log_modified_ns: Mapped[int | None] = mapped_column(BigInteger, default=None)
    log_sha256: Mapped[str | None] = mapped_column(Text, default=None)
    """Of the whole log, once it has ended."""


class JobRow(Base):
    """One piece of work on a run."""

    __tablename__ = "jobs"

    id: Mapped[str] = mapped_column(Text, primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"), index=True)
    kind: Mapped[str] = mapped_column(Text, default="identify")
    key: Mapped[str] = mapped_column(Text, index=True)
    """Of the content: the same log with the same settings has the same key."""
    settings: Mapped[dict[str, Any]] = mapped_column(JSON)
    state: Mapped[JobState] = mapped_column(_words(JobState), index=True)
    attempts: Mapped[int] = mapped_column(default=0)
    """Times that a worker began."""
    created: Mapped[datetime] = mapped_column(UtcTime)
    started: Mapped[datetime | None] = mapped_column(UtcTime, default=None)
    finished: Mapped[datetime | None] = mapped_column(UtcTime, default=None)
    doing: Mapped[str] = mapped_column(Text, default="")
    """What it says of itself."""
    error: Mapped[str] = mapped_column(Text, default="")
    """Why it has failed."""
    result: Mapped[str | None] = mapped_column(Text, default=None)
    """Folder of fit and report, from the data folder or absolute."""
    summary: Mapped[dict[str, Any] | None] = mapped_column(JSON, default=None)
    """The fit in short."""

"""Tables of the catalogue: runs and the jobs on them."""

from datetime import UTC, datetime
from typing import Any, Literal, TypeAlias, get_args

from sqlalchemy import JSON, BigInteger, DateTime, Dialect, Enum, ForeignKey, Index, Text
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column, relationship
from sqlalchemy.types import TypeDecorator

from bench.endings import RunEnding

RunState: TypeAlias = Literal["running", "ended", "truncated"]
"""truncated: the log has no end and is no longer being written."""
LogIntegrity: TypeAlias = Literal["intact", "changed", "missing"]
"""Comparison of a log with its stored hash; missing: the file does not exist."""
RunOutcome: TypeAlias = Literal["clean", "lossy", "truncated", "incomplete"]
JobState: TypeAlias = Literal["queued", "running", "done", "failed", "cancelled"]
NotificationState: TypeAlias = Literal["due", "sent", "failed"]
"""due: an attempt is to follow; failed: none is."""
NoteKind: TypeAlias = Literal["note", "tags"]
"""A text of a person, or the record of changed tags."""
UNFINISHED_STATES: tuple[JobState, ...] = ("queued", "running")
"""States of a job that is not finished."""


class UtcTime(TypeDecorator[datetime]):
    """Column type for a UTC time, also in databases that store no time zone."""

    impl = DateTime
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Convert a time to UTC without time zone, for the database."""
        return None if value is None else value.astimezone(UTC).replace(tzinfo=None)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Add the time zone UTC to a time from the database."""
        return None if value is None else value.replace(tzinfo=UTC)


def _make_enum_column(literal: Any) -> Enum:
    """Return a column type for the values of a Literal, stored as text without constraint so that it can grow."""
    return Enum(*get_args(literal), native_enum=False, create_constraint=False, length=16)


class Base(DeclarativeBase):
    """Base class of all tables."""


class RunRow(Base):
    """One run and its log."""

    __tablename__ = "runs"
    __table_args__ = (
        Index("runs_newest_first", "started", "id"),
        Index("runs_of_specimen", "specimen", "started", "id"),
        Index("runs_of_bench", "bench", "started", "id"),
    )

    id: Mapped[str] = mapped_column(Text, primary_key=True)
    method: Mapped[str] = mapped_column(Text)
    method_version: Mapped[int | None] = mapped_column(default=None)
    """Version of the method; None if its content was not stored under its name."""
    method_sha256: Mapped[str | None] = mapped_column(Text, default=None)
    """Hash of the content of the method; None in runs of older versions and in imports."""
    specimen: Mapped[str] = mapped_column(Text, default="")
    operator: Mapped[str] = mapped_column(Text, default="")
    bench: Mapped[str | None] = mapped_column(Text, default=None)
    """Name of the bench in the service; None in runs of older versions, in imports and in logs found later."""
    source: Mapped[str] = mapped_column(Text, default="run")
    """``run``, or ``import`` for a recording made elsewhere."""
    started: Mapped[datetime] = mapped_column(UtcTime)
    """UTC; for an import without this information, the time at which its log was written."""
    duration_s: Mapped[float | None] = mapped_column(default=None)
    """Recorded time [s]; while the run is in progress, the planned time."""
    state: Mapped[RunState] = mapped_column(_make_enum_column(RunState), index=True)
    outcome: Mapped[RunOutcome | None] = mapped_column(_make_enum_column(RunOutcome), default=None)
    ending: Mapped[RunEnding | None] = mapped_column(_make_enum_column(RunEnding), default=None)
    """Ending of the run; None while it is in progress, and if it is not known."""
    reason: Mapped[str] = mapped_column(Text, default="")
    """Reason of an outcome other than `clean`; the agent's, if it has reported one."""
    continues: Mapped[str | None] = mapped_column(Text, default=None)
    """Id of the run that this one continues after a checkpoint; that run may be missing."""
    log: Mapped[str] = mapped_column(Text, unique=True)
    """Path of the log relative to the data folder, or absolute if it is outside."""
    log_bytes: Mapped[int | None] = mapped_column(BigInteger, default=None)
    log_modified_ns: Mapped[int | None] = mapped_column(BigInteger, default=None)
    log_sha256: Mapped[str | None] = mapped_column(Text, default=None)
    """Hash of the complete log, once the run has ended; never replaced, because fits refer to it."""
    integrity: Mapped[LogIntegrity | None] = mapped_column(_make_enum_column(LogIntegrity), default=None)
    """Result of the latest check; None before the first."""
    found_sha256: Mapped[str | None] = mapped_column(Text, default=None)
    """Hash that the latest check found in a changed log."""
    checked: Mapped[datetime | None] = mapped_column(UtcTime, default=None)
    """UTC of the latest check."""
    copy_url: Mapped[str | None] = mapped_column(Text, default=None)
    """Address of the verified copy of the log in a log store; None without one."""
    copied: Mapped[datetime | None] = mapped_column(UtcTime, default=None)
    """UTC at which the copy was verified."""
    removed: Mapped[datetime | None] = mapped_column(UtcTime, default=None)
    """UTC at which the log was removed from this machine after its copy; None while it is here."""
    fetched: Mapped[datetime | None] = mapped_column(UtcTime, default=None)
    """UTC at which the log was last fetched from its copy."""
    lost: Mapped[dict[str, int] | None] = mapped_column(JSON(none_as_null=True), default=None)
    """Number of lost samples by channel; None until the end of the log was read."""
    alarms: Mapped[list[str] | None] = mapped_column(JSON(none_as_null=True), default=None)
    """Texts of the alarms in the log; None until its events were read."""
    calibration_overdue: Mapped[list[str] | None] = mapped_column(JSON(none_as_null=True), default=None)
    """Channels whose calibration was overdue at the start, in words; None in runs of older versions."""
    failed_checks: Mapped[list[str] | None] = mapped_column(JSON(none_as_null=True), default=None)
    """Channels whose latest check had failed at the start, in words; None in runs of older versions."""
    tags: Mapped[list[str]] = mapped_column(JSON, default=list)
    """Words by which a person sorts runs; each change is also a note."""
    revision: Mapped[int] = mapped_column(default=0)
    """Number of changes of what a person can change."""
    trashed: Mapped[datetime | None] = mapped_column(UtcTime, default=None)
    """UTC at which the run was moved to the trash; None outside it."""


class JobRow(Base):
    """One identification or diagnosis of a run by a worker; a job that is tried again keeps its row."""

    __tablename__ = "jobs"
    __table_args__ = (Index("jobs_newest_result", "run_id", "kind", "state", "finished", "id"),)

    id: Mapped[str] = mapped_column(Text, primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"), index=True)
    kind: Mapped[str] = mapped_column(Text, default="identify")
    key: Mapped[str] = mapped_column(Text, index=True)
    """Hash of log, settings, inputs and version: equal jobs have equal keys."""
    settings: Mapped[dict[str, Any]] = mapped_column(JSON)
    state: Mapped[JobState] = mapped_column(_make_enum_column(JobState), index=True)
    inputs: Mapped[dict[str, str]] = mapped_column(JSON, default=dict)
    """Ids of the jobs whose results it reads: `fit` for the report, `model` for its own gap."""
    version: Mapped[str] = mapped_column(Text, default="")
    """Version of mrbench at the request; empty for jobs of versions that did not record it."""
    attempts: Mapped[int] = mapped_column(default=0)
    """Number of times that a worker started the job, over all submissions."""
    submissions: Mapped[int] = mapped_column(default=1)
    """Number of times that the job was queued: at its request, and for each retry."""
    earlier_attempts: Mapped[int] = mapped_column(default=0)
    """Number of attempts of the earlier submissions."""
    retries: Mapped[list[dict[str, str]]] = mapped_column(JSON, default=list)
    """Reason of each retry, with its time, and the state and error that it followed."""
    created: Mapped[datetime] = mapped_column(UtcTime)
    queued: Mapped[datetime | None] = mapped_column(UtcTime, default=None)
    """Time of the latest submission; null in jobs of older versions, whose only one is their creation."""
    started: Mapped[datetime | None] = mapped_column(UtcTime, default=None)
    finished: Mapped[datetime | None] = mapped_column(UtcTime, default=None)
    activity: Mapped[str] = mapped_column("doing", Text, default="")
    """Present activity of the running job. The column keeps the name `doing` of older versions."""
    stage: Mapped[str] = mapped_column(Text, default="")
    """Present or last stage of the job."""
    fraction: Mapped[float | None] = mapped_column(default=None)
    """Completed share of the job, 0 to 1; null before its first start."""
    error: Mapped[str] = mapped_column(Text, default="")
    """Reason of a failure."""
    result: Mapped[str | None] = mapped_column(Text, default=None)
    """Folder of the results, relative to the data folder or absolute."""
    summary: Mapped[dict[str, Any] | None] = mapped_column(JSON, default=None)
    """Errors and parameters of a fit; verdict, effects and shrinkage of a diagnosis."""


class BatchRow(Base):
    """One request of the same job for several runs."""

    __tablename__ = "batches"

    id: Mapped[str] = mapped_column(Text, primary_key=True)
    kind: Mapped[str] = mapped_column(Text)
    settings: Mapped[dict[str, Any]] = mapped_column(JSON)
    created: Mapped[datetime] = mapped_column(UtcTime)
    items: Mapped[list[dict[str, str]]] = mapped_column(JSON)
    """For each run its id, and the id of its job or the reason why there is none."""


class NoteRow(Base):
    """One note on a run; notes are added and never changed."""

    __tablename__ = "notes"

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id"), index=True)
    at: Mapped[datetime] = mapped_column(UtcTime)
    """UTC."""
    author: Mapped[str] = mapped_column(Text)
    kind: Mapped[NoteKind] = mapped_column(_make_enum_column(NoteKind))
    text: Mapped[str] = mapped_column(Text)


class EventRow(Base):
    """One event of the bench or of a run."""

    __tablename__ = "events"

    id: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[str | None] = mapped_column(ForeignKey("runs.id"), index=True)
    """Run that the event belongs to; None outside runs."""
    bench: Mapped[str | None] = mapped_column(Text, default=None)
    """Name of the bench in the service; None in events of older versions and of imports."""
    at: Mapped[datetime] = mapped_column(UtcTime)
    """UTC; of an import without a start time, counted from the time of its log."""
    time_s: Mapped[float | None] = mapped_column(default=None)
    """Time since the first sample of the run [s]; None until the log was read."""
    kind: Mapped[str] = mapped_column(Text)
    text: Mapped[str] = mapped_column(Text)


class CampaignRow(Base):
    """One campaign with its present state, which is its latest restore point."""

    __tablename__ = "campaigns"

    id: Mapped[str] = mapped_column(Text, primary_key=True)
    name: Mapped[str] = mapped_column(Text)
    key: Mapped[str] = mapped_column(Text, index=True)
    """Hash of document and methods: equal campaigns have equal keys."""
    bench: Mapped[str] = mapped_column(Text, default="")
    """Executor: `agent`, name of one of several benches, or `scenario NAME` for the simulated plant."""
    status: Mapped[str] = mapped_column(Text, index=True)
    created: Mapped[datetime] = mapped_column(UtcTime)
    methods: Mapped[dict[str, Any]] = mapped_column(JSON)
    """Documents of the methods by name, fixed for the whole campaign."""
    state: Mapped[dict[str, Any]] = mapped_column(JSON)


class CampaignEventRow(Base):
    """One event of a campaign: restore point, edit, message."""

    __tablename__ = "campaign_events"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    campaign_id: Mapped[str] = mapped_column(ForeignKey("campaigns.id"), index=True)
    at: Mapped[datetime] = mapped_column(UtcTime)
    kind: Mapped[str] = mapped_column(Text)
    text: Mapped[str] = mapped_column(Text)
    who: Mapped[str] = mapped_column(Text, default="")
    item: Mapped[str] = mapped_column(Text, default="")
    """Id of the step; empty for the campaign as a whole."""
    notifications: Mapped[list["CampaignNotificationRow"]] = relationship(
        lazy="selectin", order_by="CampaignNotificationRow.id"
    )
    """One for each recipient; empty where nobody is told."""


class CampaignNotificationRow(Base):
    """Event of a campaign as a message to one recipient."""

    __tablename__ = "campaign_notifications"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    event_id: Mapped[int] = mapped_column(ForeignKey("campaign_events.id"), index=True)
    recipient: Mapped[dict[str, Any]] = mapped_column(JSON)
    """Recipient as the campaign names it."""
    state: Mapped[NotificationState] = mapped_column(Text, default="due", index=True)
    attempts: Mapped[int] = mapped_column(default=0)
    """Number of attempts that have begun."""
    next_attempt: Mapped[datetime | None] = mapped_column(UtcTime)
    """UTC from which the next attempt may begin; None if there is none."""
    reason: Mapped[str] = mapped_column(Text, default="")
    """Reason why the latest attempt has failed."""

"""Records of checks, and the baselines from which their control charts begin."""

from collections.abc import Iterable
from datetime import UTC, datetime
from typing import cast

from sqlalchemy import ColumnElement, Engine, ForeignKey, Select, Text, delete, func, select
from sqlalchemy.orm import Mapped, mapped_column, sessionmaker

from bench.calibration import LatestCheck
from bench.catalogue.models import Base, RunRow, UtcTime
from bench.checks import (
    CheckKind,
    CheckRecord,
    CheckSeries,
    CheckValue,
    ControlChart,
    describe_latest,
    make_chart,
)
from bench.config import DEFAULT_BENCH, ChannelName


class CheckRow(Base):
    """Record of one check for one channel, computed from the log of its run."""

    __tablename__ = "check_records"

    run: Mapped[str] = mapped_column(ForeignKey("runs.id"), primary_key=True)
    check: Mapped[str] = mapped_column("check_kind", Text, primary_key=True)
    channel: Mapped[str] = mapped_column(Text, primary_key=True)
    unit: Mapped[str] = mapped_column(Text)
    value: Mapped[float] = mapped_column()
    standard_deviation: Mapped[float] = mapped_column()
    standard_uncertainty: Mapped[float] = mapped_column()
    samples: Mapped[int] = mapped_column()
    independent_samples: Mapped[float] = mapped_column()
    duration_s: Mapped[float] = mapped_column()
    measured: Mapped[datetime] = mapped_column(UtcTime, index=True)
    specimen: Mapped[str] = mapped_column(Text)
    bench: Mapped[str] = mapped_column(Text)
    instrument: Mapped[str] = mapped_column(Text)
    serial: Mapped[str] = mapped_column(Text)
    temperature_c: Mapped[float | None] = mapped_column()

    def to_record(self) -> CheckRecord:
        """Return the record."""
        return CheckRecord.model_validate({name: getattr(self, name) for name in CheckRecord.model_fields})


class BaselineRow(Base):
    """Begin of a new baseline: earlier checks of the series no longer count."""

    __tablename__ = "check_baselines"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=True)
    check: Mapped[str] = mapped_column("check_kind", Text)
    channel: Mapped[str] = mapped_column(Text, index=True)
    specimen: Mapped[str] = mapped_column(Text)
    bench: Mapped[str] = mapped_column(Text, default=DEFAULT_BENCH)
    """Name of the bench in the service."""
    since: Mapped[datetime] = mapped_column(UtcTime)
    author: Mapped[str] = mapped_column(Text)
    reason: Mapped[str] = mapped_column(Text)


class CheckStore:
    """Checks in the database of a catalogue; safe from any thread."""

    def __init__(self, engine: Engine) -> None:
        """Use an open database."""
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def replace(self, run_id: str, records: Iterable[CheckRecord]) -> None:
        """Store the records of a run in place of its former ones."""
        with self._sessions.begin() as session:
            session.execute(delete(CheckRow).where(CheckRow.run == run_id))
            session.add_all(CheckRow(**record.model_dump()) for record in records)

    def list_newest(
        self, limit: int, channel: str | None = None, bench: str | None = None, check: CheckKind | None = None
    ) -> list[CheckRecord]:
        """Return the newest records, without those of runs in the trash.

        Args:
            limit: largest number of records.
            channel: only those of this channel; None for all.
            bench: only those of this bench of the service; None for all.
            check: only those of this kind; None for all.
        """
        query = _select_present(bench).order_by(CheckRow.measured.desc(), CheckRow.run.desc(), CheckRow.channel)
        if channel is not None:
            query = query.where(CheckRow.channel == channel)
        if check is not None:
            query = query.where(CheckRow.check == check)
        with self._sessions() as session:
            return [row.to_record() for row in session.scalars(query.limit(limit))]

    def find_latest(
        self, channel: str, bench: str = DEFAULT_BENCH, check: CheckKind = "zero"
    ) -> CheckRecord | None:
        """Return the latest record of one kind of a channel of a bench, or None."""
        return next(iter(self.list_newest(1, channel, bench, check)), None)

    def find_series(
        self, channel: ChannelName, specimen: str | None, bench: str = DEFAULT_BENCH, check: CheckKind = "zero"
    ) -> CheckSeries:
        """Return the series of a channel with a specimen; with None that of its latest check of this kind."""
        if specimen is None:
            latest = self.find_latest(channel, bench, check)
            specimen = "" if latest is None else latest.specimen
        return CheckSeries(check=check, channel=channel, specimen=specimen)

    def make_chart(self, series: CheckSeries, bench: str = DEFAULT_BENCH) -> ControlChart:
        """Return the control chart of a series on a bench."""
        since, checks = self._list_counting(series, bench)
        return make_chart(series, checks, since)

    def make_latest_charts(self, bench: str = DEFAULT_BENCH, check: CheckKind = "zero") -> list[ControlChart]:
        """Return for each channel of a bench the chart that its latest check of this kind belongs to."""
        return [self.make_chart(series, bench) for series in self._list_series(bench) if series.check == check]

    def list_latest(self, bench: str = DEFAULT_BENCH) -> tuple[LatestCheck, ...]:
        """Return the latest check of each channel and kind of a bench that counts, with its state in its chart."""
        found = ((series, self._list_counting(series, bench)[1]) for series in self._list_series(bench))
        return tuple(_describe_latest(series, checks) for series, checks in found if checks)

    def begin_baseline(self, series: CheckSeries, author: str, reason: str, bench: str = DEFAULT_BENCH) -> None:
        """Let only checks from now on count in a series on a bench."""
        facts = series.model_dump() | {"bench": bench, "author": author, "reason": reason}
        row = BaselineRow(**facts, since=datetime.now(UTC))
        with self._sessions.begin() as session:
            session.add(row)

    def find_baseline(self, series: CheckSeries, bench: str = DEFAULT_BENCH) -> BaselineRow | None:
        """Return the latest begin of a baseline on a bench; None if all checks of the series count."""
        matching = select(BaselineRow).where(*_match(BaselineRow, series), BaselineRow.bench == bench)
        query = matching.order_by(BaselineRow.id.desc()).limit(1)
        with self._sessions() as session:
            return session.scalar(query)

    def _list_series(self, bench: str) -> list[CheckSeries]:
        """Return the series that the latest check of each channel and kind of a bench belongs to."""
        known = select(CheckRow.channel, CheckRow.check).distinct().order_by(CheckRow.channel, CheckRow.check)
        with self._sessions() as session:
            pairs = session.execute(known).all()
        latest = (self.find_latest(channel, bench, cast("CheckKind", check)) for channel, check in pairs)
        return [_find_series(record) for record in latest if record is not None]

    def _list_counting(self, series: CheckSeries, bench: str) -> tuple[datetime | None, list[CheckValue]]:
        """Return the UTC from which checks count, None for all, and these checks, the oldest first."""
        baseline = self.find_baseline(series, bench)
        query = _select_present(bench).where(*_match(CheckRow, series))
        query = query.order_by(CheckRow.measured, CheckRow.run)
        if baseline is not None:
            query = query.where(CheckRow.measured >= baseline.since)
        # Columns only: rows of years are read for each start of a run.
        columns = query.with_only_columns(
            CheckRow.run, CheckRow.measured, CheckRow.value, CheckRow.standard_uncertainty
        )
        with self._sessions() as session:
            checks = [CheckValue(*row) for row in session.execute(columns)]
        return None if baseline is None else baseline.since, checks


def _describe_latest(series: CheckSeries, checks: list[CheckValue]) -> LatestCheck:
    state, text = describe_latest(series, checks)
    latest = checks[-1]
    return LatestCheck(
        channel=series.channel,
        check=series.check,
        run=latest.run,
        measured=latest.measured,
        state=state,
        text=text,
    )


def _select_present(bench: str | None) -> Select[CheckRow]:
    """Return the query for the records outside the trash; a run without a bench counts for `DEFAULT_BENCH`."""
    query = select(CheckRow).join(RunRow, RunRow.id == CheckRow.run).where(RunRow.trashed.is_(None))
    return query if bench is None else query.where(func.coalesce(RunRow.bench, DEFAULT_BENCH) == bench)


def _match(table: type[CheckRow | BaselineRow], series: CheckSeries) -> tuple[ColumnElement[bool], ...]:
    return (
        table.check == series.check,
        table.channel == series.channel,
        table.specimen == series.specimen,
    )


def _find_series(record: CheckRecord) -> CheckSeries:
    return CheckSeries(check=record.check, channel=record.channel, specimen=record.specimen)

"""Records of checks, and the baselines from which their control charts begin."""

from collections.abc import Iterable
from datetime import UTC, datetime

from sqlalchemy import ColumnElement, Engine, ForeignKey, Select, Text, delete, select
from sqlalchemy.orm import Mapped, mapped_column, sessionmaker

from bench.calibration import LatestCheck
from bench.catalogue.models import Base, RunRow, UtcTime
from bench.checks import CheckRecord, CheckSeries, CheckValue, ControlChart, describe_latest, make_chart
from bench.config import ChannelName


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

    def list_newest(self, limit: int, channel: str | None = None) -> list[CheckRecord]:
        """Return the newest records, without those of runs in the trash.

        Args:
            limit: largest number of records.
            channel: only those of this channel; None for all.
        """
        query = _select_present().order_by(CheckRow.measured.desc(), CheckRow.run.desc(), CheckRow.channel)
        if channel is not None:
            query = query.where(CheckRow.channel == channel)
        with self._sessions() as session:
            return [row.to_record() for row in session.scalars(query.limit(limit))]

    def find_latest(self, channel: str) -> CheckRecord | None:
        """Return the latest record of a channel, or None."""
        return next(iter(self.list_newest(1, channel)), None)

    def find_series(self, channel: ChannelName, specimen: str | None) -> CheckSeries:
        """Return the series of a channel with a specimen; with None that of the channel's latest check."""
        if specimen is None:
            latest = self.find_latest(channel)
            specimen = "" if latest is None else latest.specimen
        return CheckSeries(check="zero", channel=channel, specimen=specimen)

    def make_chart(self, series: CheckSeries) -> ControlChart:
        """Return the control chart of a series."""
        since, checks = self._list_counting(series)
        return make_chart(series, checks, since)

    def make_latest_charts(self) -> list[ControlChart]:
        """Return for each channel the chart that its latest check belongs to."""
        return [self.make_chart(series) for series in self._list_series()]

    def list_latest(self) -> tuple[LatestCheck, ...]:
        """Return the latest check of each channel that counts, with its state in its chart."""
        found = ((series, self._list_counting(series)[1]) for series in self._list_series())
        return tuple(_describe_latest(series, checks) for series, checks in found if checks)

    def begin_baseline(self, series: CheckSeries, author: str, reason: str) -> None:
        """Let only checks from now on count in a series."""
        row = BaselineRow(**series.model_dump(), since=datetime.now(UTC), author=author, reason=reason)
        with self._sessions.begin() as session:
            session.add(row)

    def find_baseline(self, series: CheckSeries) -> BaselineRow | None:
        """Return the latest begin of a baseline; None if all checks of the series count."""
        query = select(BaselineRow).where(*_match(BaselineRow, series)).order_by(BaselineRow.id.desc()).limit(1)
        with self._sessions() as session:
            return session.scalar(query)

    def _list_series(self) -> list[CheckSeries]:
        """Return the series that the latest check of each channel belongs to."""
        with self._sessions() as session:
            channels = session.scalars(select(CheckRow.channel).distinct().order_by(CheckRow.channel)).all()
        latest = (self.find_latest(channel) for channel in channels)
        return [_find_series(record) for record in latest if record is not None]

    def _list_counting(self, series: CheckSeries) -> tuple[datetime | None, list[CheckValue]]:
        """Return the UTC from which checks count, None for all, and these checks, the oldest first."""
        baseline = self.find_baseline(series)
        query = _select_present().where(*_match(CheckRow, series)).order_by(CheckRow.measured, CheckRow.run)
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


def _select_present() -> Select[CheckRow]:
    return select(CheckRow).join(RunRow, RunRow.id == CheckRow.run).where(RunRow.trashed.is_(None))


def _match(table: type[CheckRow | BaselineRow], series: CheckSeries) -> tuple[ColumnElement[bool], ...]:
    return (
        table.check == series.check,
        table.channel == series.channel,
        table.specimen == series.specimen,
    )


def _find_series(record: CheckRecord) -> CheckSeries:
    return CheckSeries(check=record.check, channel=record.channel, specimen=record.specimen)

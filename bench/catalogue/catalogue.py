"""What is known of runs and jobs: added, changed and found by plain calls, from any thread."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sqlalchemy import Engine, select, tuple_, update
from sqlalchemy.orm import Session, sessionmaker

from bench.catalogue.models import UNFINISHED, JobRow, JobState, RunRow


class Catalogue:
    """The catalogue of one data folder. Rows that it hands out are copies; changes go through its methods."""

    def __init__(self, engine: Engine, folder: Path) -> None:
        """Take an open database.

        Args:
            engine: as `open_database` gives it.
            folder: the data folder, absolute.
        """
        self.folder = folder
        self._engine = engine
        # Rows are read after their session has ended: they must not be fetched again.
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def close(self) -> None:
        """Give all connections back."""
        self._engine.dispose()

    def name_of(self, path: Path) -> str:
        """How a file is named here: from the data folder where it lies inside, so that the folder may move."""
        return str(path.relative_to(self.folder)) if path.is_relative_to(self.folder) else str(path)

    def path_of(self, name: str) -> Path:
        """Where a file lies that is named so."""
        return self.folder / name

    def add(self, row: RunRow | JobRow) -> None:
        """Add a run or a job."""
        with self._sessions.begin() as session:
            session.add(row)

    def run(self, run_id: str) -> RunRow | None:
        """One run, or none of that id."""
        with self._sessions() as session:
            return session.get(RunRow, run_id)

    def runs(self, limit: int, before: RunRow | None = None) -> Sequence[RunRow]:
        """Runs, newest first.

        Args:
            limit: how many at most.
            before: only those that come after this one in the order.
        """
        query = select(RunRow).order_by(RunRow.started.desc(), RunRow.id.desc()).limit(limit)
        # From a row, not from a count: runs that are added meanwhile shift no page.
        if before is not None:
            query = query.where(tuple_(RunRow.started, RunRow.id) < tuple_(before.started, before.id))
        with self._sessions() as session:
            return session.scalars(query).all()

    def run_of_log(self, path: Path) -> RunRow | None:
        """The run whose log this is."""
        with self._sessions() as session:
            return session.scalar(select(RunRow).where(RunRow.log == self.name_of(path)))

    def running(self) -> Sequence[RunRow]:
        """Runs that go on, as far as is known."""
        with self._sessions() as session:
            return session.scalars(select(RunRow).where(RunRow.state == "running")).all()

    def change_run(self, run_id: str, **values: Any) -> RunRow:
        """Set some columns of a run; the run as it is then."""
        with self._sessions.begin() as session:
            row = session.get_one(RunRow, run_id)
            for name, value in values.items():
                setattr(row, name, value)
            return row

    def job(self, job_id: str) -> JobRow | None:
        """One job, or none of that id."""
        with self._sessions() as session:
            return session.get(JobRow, job_id)

    def jobs(self, limit: int, run_ids: Sequence[str] | None = None) -> Sequence[JobRow]:
        """Jobs, newest first, of all runs or of some.

        Args:
            limit: how many at most.
            run_ids: the runs; None for all.
        """
        query = select(JobRow).order_by(JobRow.created.desc(), JobRow.id).limit(limit)
        if run_ids is not None:
            query = query.where(JobRow.run_id.in_(run_ids))
        with self._sessions() as session:
            return session.scalars(query).all()

    def unfinished_jobs(self) -> Sequence[JobRow]:
        """Jobs that a worker still owes an answer, oldest first."""
        query = select(JobRow).where(JobRow.state.in_(UNFINISHED)).order_by(JobRow.created)
        with self._sessions() as session:
            return session.scalars(query).all()

    def add_job_once(self, job: JobRow) -> tuple[JobRow, bool]:
        """Add a job unless its work is done or on its way.

        Returns:
            The job that stands for this content, and whether it is the new one.
        """
        same = select(JobRow).where(JobRow.key == job.key, JobRow.state.in_((*UNFINISHED, "done")))
        with self._write() as session:
            there = session.scalars(same.order_by(JobRow.created.desc())).first()
            if there is None:
                session.add(job)
            session.commit()
            return (job, True) if there is None else (there, False)

    def _write(self) -> Session:
        """A session that has the writer's place from its first word on, so that look and add are one."""
        session = self._sessions()
        if self._engine.dialect.name == "sqlite":
            session.connection().exec_driver_sql("BEGIN IMMEDIATE")
        return session

    def change_job(self, job_id: str, among: Sequence[JobState] = UNFINISHED, **values: Any) -> JobRow | None:
        """Set some columns of a job.

        Args:
            job_id: which.
            among: only if it is in one of these states; what has ended stays as it ended.
            values: the columns.

        Returns:
            The job as it is then, or none where nothing was changed.
        """
        change = update(JobRow).where(JobRow.id == job_id, JobRow.state.in_(among)).values(**values)
        with self._sessions.begin() as session:
            return session.scalar(change.returning(JobRow))

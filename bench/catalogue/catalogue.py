"""Access to the rows of runs and jobs; safe from any thread."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sqlalchemy import Engine, select, tuple_, update
from sqlalchemy.orm import Session, sessionmaker

from bench.catalogue.models import UNFINISHED_STATES, JobRow, JobState, RunRow


class Catalogue:
    """Catalogue of one data folder. Returned rows are copies: use its methods to change them."""

    def __init__(self, engine: Engine, folder: Path) -> None:
        """Use an open database.

        Args:
            engine: from `open_database`.
            folder: the data folder, absolute.
        """
        self.folder = folder
        self._engine = engine
        # Rows are read after their session has ended, so they must not expire with it.
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def close(self) -> None:
        """Close all connections."""
        self._engine.dispose()

    def make_name(self, path: Path) -> str:
        """Return a file's name in the catalogue.

        It is relative to the data folder if the file is inside it, so that the folder can be moved.
        """
        return str(path.relative_to(self.folder)) if path.is_relative_to(self.folder) else str(path)

    def resolve_path(self, name: str) -> Path:
        """Return the path of a file by its name in the catalogue."""
        return self.folder / name

    def add(self, row: RunRow | JobRow) -> None:
        """Add a run or a job."""
        with self._sessions.begin() as session:
            session.add(row)

    def get_run(self, run_id: str) -> RunRow | None:
        """Return the run with an id, or None."""
        with self._sessions() as session:
            return session.get(RunRow, run_id)

    def list_runs(self, limit: int, before: RunRow | None = None) -> Sequence[RunRow]:
        """Return runs, newest first.

        Args:
            limit: largest number of runs.
            before: return only runs that come after this one in the order.
        """
        query = select(RunRow).order_by(RunRow.started.desc(), RunRow.id.desc()).limit(limit)
        # Pages start at a row, not at a count: a run that is added meanwhile then shifts no page.
        if before is not None:
            query = query.where(tuple_(RunRow.started, RunRow.id) < tuple_(before.started, before.id))
        with self._sessions() as session:
            return session.scalars(query).all()

    def find_run_by_log(self, path: Path) -> RunRow | None:
        """Return the run that a log belongs to, or None."""
        with self._sessions() as session:
            return session.scalar(select(RunRow).where(RunRow.log == self.make_name(path)))

    def list_running(self) -> Sequence[RunRow]:
        """Return the runs in state `running`."""
        with self._sessions() as session:
            return session.scalars(select(RunRow).where(RunRow.state == "running")).all()

    def update_run(self, run_id: str, **values: Any) -> RunRow:
        """Set columns of a run and return the changed run."""
        with self._sessions.begin() as session:
            row = session.get_one(RunRow, run_id)
            for name, value in values.items():
                setattr(row, name, value)
            return row

    def get_job(self, job_id: str) -> JobRow | None:
        """Return the job with an id, or None."""
        with self._sessions() as session:
            return session.get(JobRow, job_id)

    def list_jobs(self, limit: int, run_ids: Sequence[str] | None = None) -> Sequence[JobRow]:
        """Return jobs, newest first.

        Args:
            limit: largest number of jobs.
            run_ids: ids of the runs; None for all runs.
        """
        query = select(JobRow).order_by(JobRow.created.desc(), JobRow.id).limit(limit)
        if run_ids is not None:
            query = query.where(JobRow.run_id.in_(run_ids))
        with self._sessions() as session:
            return session.scalars(query).all()

    def list_unfinished_jobs(self) -> Sequence[JobRow]:
        """Return queued and running jobs, oldest first."""
        query = select(JobRow).where(JobRow.state.in_(UNFINISHED_STATES)).order_by(JobRow.created)
        with self._sessions() as session:
            return session.scalars(query).all()

    def add_job_once(self, job: JobRow) -> tuple[JobRow, bool]:
        """Add a job unless one with the same key is queued, running or done.

        Returns:
            The job with this key, and whether it was added now.
        """
        same_key = select(JobRow).where(JobRow.key == job.key, JobRow.state.in_((*UNFINISHED_STATES, "done")))
        with self._begin_write() as session:
            existing = session.scalars(same_key.order_by(JobRow.created.desc())).first()
            if existing is None:
                session.add(job)
            session.commit()
            return (job, True) if existing is None else (existing, False)

    def _begin_write(self) -> Session:
        """Return a session that locks the database for writing at once, so that reading and adding are atomic."""
        session = self._sessions()
        if self._engine.dialect.name == "sqlite":
            session.connection().exec_driver_sql("BEGIN IMMEDIATE")
        return session

    def update_job(
        self, job_id: str, states: Sequence[JobState] = UNFINISHED_STATES, **values: Any
    ) -> JobRow | None:
        """Set columns of a job.

        Args:
            job_id: id of the job.
            states: change the job only in one of these states; by default a finished job stays as it is.
            values: value by column.

        Returns:
            The changed job, or None if nothing was changed.
        """
        change = update(JobRow).where(JobRow.id == job_id, JobRow.state.in_(states)).values(**values)
        with self._sessions.begin() as session:
            return session.scalar(change.returning(JobRow))

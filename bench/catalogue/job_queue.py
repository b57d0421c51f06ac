"""Queue of jobs: changes that read and write at once, the order of the queue, and batches."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import ColumnElement, Engine, func, select, tuple_
from sqlalchemy.orm import Session, sessionmaker

from bench.catalogue.database import begin_write
from bench.catalogue.models import UNFINISHED_STATES, BatchRow, JobRow, JobState

REPEATABLE_STATES: tuple[JobState, ...] = ("failed", "cancelled")
"""States after which a job can be queued again."""


@dataclass(frozen=True)
class JobFilter:
    """Selection of jobs; None selects all."""

    states: Sequence[JobState] | None = None
    kind: str | None = None
    run_id: str | None = None

    def make_conditions(self) -> list[ColumnElement[bool]]:
        """Return the conditions of a query for the selected jobs."""
        conditions: list[ColumnElement[bool]] = []
        if self.states is not None:
            conditions.append(JobRow.state.in_(self.states))
        if self.kind is not None:
            conditions.append(JobRow.kind == self.kind)
        if self.run_id is not None:
            conditions.append(JobRow.run_id == self.run_id)
        return conditions


class JobQueue:
    """Queue of the jobs of a catalogue; safe from any thread. Returned rows are copies."""

    def __init__(self, engine: Engine) -> None:
        """Use an open database."""
        self._engine = engine
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def find_repeatable(self, key: str) -> Sequence[JobRow]:
        """Return the failed and cancelled jobs with a key."""
        query = select(JobRow).where(JobRow.key == key, JobRow.state.in_(REPEATABLE_STATES))
        with self._sessions() as session:
            return session.scalars(query).all()

    def request(self, job: JobRow, has_files: Callable[[JobRow], bool]) -> tuple[JobRow, bool]:
        """Queue a job: a new one, or the one with the same key if that has no result.

        Args:
            job: the job, which is only added if none has its key.
            has_files: returns whether the files of a done job still exist.

        Returns:
            The job with this key, and whether it was queued now.
        """
        with begin_write(self._engine, JobRow) as session:
            present = _find_by_key(session, job.key)
            if present is None:
                session.add(job)
            elif present.state in REPEATABLE_STATES:
                _queue_again(present, "requested again")
            elif present.state == "done" and not has_files(present):
                _queue_again(present, "requested again, because its files were removed")
            else:
                return present, False
            session.commit()
            return present or job, True

    def retry(self, job_id: str, reason: str) -> JobRow | None:
        """Queue a failed or cancelled job again; return None if it is in another state."""
        with begin_write(self._engine, JobRow) as session:
            job = session.get(JobRow, job_id)
            if job is None or job.state not in REPEATABLE_STATES:
                return None
            _queue_again(job, reason)
            session.commit()
            return job

    def finish(self, job_id: str, follow_up: JobRow | None, **values: Any) -> tuple[JobRow | None, JobRow | None]:
        """Record the end of an unfinished job, and queue the job that follows, both or neither.

        Args:
            job_id: id of the job that ended.
            follow_up: job to queue, unless its run already has one of its kind; None for none.
            values: value by column.

        Returns:
            The ended job, or None if it had ended before; the job that was queued, or None.
        """
        with begin_write(self._engine, JobRow) as session:
            job = session.get(JobRow, job_id)
            if job is None or job.state not in UNFINISHED_STATES:
                return None, None
            for name, value in values.items():
                setattr(job, name, value)
            if follow_up is not None and _has_kind(session, follow_up):
                follow_up = None
            if follow_up is not None:
                session.add(follow_up)
            session.commit()
            return job, follow_up

    def list_jobs(self, selection: JobFilter, limit: int, before: JobRow | None = None) -> Sequence[JobRow]:
        """Return jobs, newest first.

        Args:
            selection: the jobs to return.
            limit: largest number of jobs.
            before: return only jobs that come after this one in the order.
        """
        query = select(JobRow).where(*selection.make_conditions())
        query = query.order_by(JobRow.created.desc(), JobRow.id.desc()).limit(limit)
        if before is not None:
            query = query.where(tuple_(JobRow.created, JobRow.id) < tuple_(before.created, before.id))
        with self._sessions() as session:
            return session.scalars(query).all()

    def find_newest_done(self, run_id: str, kind: str) -> JobRow | None:
        """Return the done job of a kind that ended last, or None; unfinished and cancelled ones hide none."""
        conditions = JobFilter(("done",), kind, run_id).make_conditions()
        query = select(JobRow).where(*conditions, JobRow.result.is_not(None))
        with self._sessions() as session:
            return session.scalars(query.order_by(JobRow.finished.desc(), JobRow.id.desc())).first()

    def rank(self) -> dict[str, int]:
        """Return the place in the queue of each queued job, 1 for the next."""
        order = func.coalesce(JobRow.queued, JobRow.created)
        query = select(JobRow.id).where(JobRow.state == "queued").order_by(order, JobRow.id)
        with self._sessions() as session:
            return {job_id: place for place, job_id in enumerate(session.scalars(query), 1)}

    def count_states(self) -> dict[str, int]:
        """Return the number of jobs in each state that occurs."""
        query = select(JobRow.state, func.count()).group_by(JobRow.state)
        with self._sessions() as session:
            return {state: int(count) for state, count in session.execute(query)}

    def list_unfinished(self) -> Sequence[JobRow]:
        """Return queued and running jobs in the order in which they were queued."""
        order = func.coalesce(JobRow.queued, JobRow.created)
        query = select(JobRow).where(JobRow.state.in_(UNFINISHED_STATES)).order_by(order, JobRow.id)
        with self._sessions() as session:
            return session.scalars(query).all()

    def add_batch(self, batch: BatchRow) -> None:
        """Add a batch."""
        with self._sessions.begin() as session:
            session.add(batch)

    def get_batch(self, batch_id: str) -> BatchRow | None:
        """Return the batch with an id, or None."""
        with self._sessions() as session:
            return session.get(BatchRow, batch_id)

    def list_batches(self, limit: int) -> Sequence[BatchRow]:
        """Return batches, newest first."""
        query = select(BatchRow).order_by(BatchRow.created.desc(), BatchRow.id).limit(limit)
        with self._sessions() as session:
            return session.scalars(query).all()

    def get_jobs(self, job_ids: Sequence[str]) -> dict[str, JobRow]:
        """Return jobs by id; unknown ids are left out."""
        query = select(JobRow).where(JobRow.id.in_(job_ids))
        with self._sessions() as session:
            return {job.id: job for job in session.scalars(query)}


def _find_by_key(session: Session, key: str) -> JobRow | None:
    """Return the job with a key; older catalogues have several, of which a done or unfinished one is preferred."""
    jobs = session.scalars(select(JobRow).where(JobRow.key == key).order_by(JobRow.created.desc())).all()
    return min(jobs, key=lambda job: job.state in REPEATABLE_STATES, default=None)


def _has_kind(session: Session, job: JobRow) -> bool:
    query = select(JobRow.id).where(JobRow.run_id == job.run_id, JobRow.kind == job.kind)
    return session.scalars(query).first() is not None


def _queue_again(job: JobRow, reason: str) -> None:
    now = datetime.now(UTC)
    entry = {"at": now.isoformat(), "reason": reason, "after": job.state, "error": job.error}
    job.retries = [*job.retries, entry]
    job.state, job.queued = "queued", now
    job.submissions += 1
    job.earlier_attempts = job.attempts
    job.error, job.activity, job.stage, job.fraction, job.finished = "", "", "", None, None

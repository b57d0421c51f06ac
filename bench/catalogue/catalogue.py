"""Access to the rows of runs and jobs; safe from any thread."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import Engine, event, func, select, tuple_, update
from sqlalchemy.orm import sessionmaker

from bench.catalogue.campaign_table import CampaignTable
from bench.catalogue.database import ChangeCounter, find_catalogue, locate_catalogue, open_database
from bench.catalogue.errors import CatalogueError
from bench.catalogue.job_queue import JobQueue
from bench.catalogue.models import UNFINISHED_STATES, JobRow, JobState, RunOutcome, RunRow
from bench.catalogue.people import SessionStore, TokenStore, UserStore
from bench.catalogue.planning import (
    SHIPPED_VERSION,
    ApprovalStore,
    CertificateStore,
    CheckStore,
    IdempotencyKeys,
    MethodLibrary,
    MethodStore,
    SpecimenStore,
)
from bench.catalogue.records import EventJournal, LogCopies, Notebook, SignatureStore
from bench.catalogue.run_filter import RunFilter
from bench.methods import list_shipped_methods, load_method


class Catalogue:
    """Catalogue of one data folder. Returned rows are copies: use its methods to change them."""

    def __init__(self, engine: Engine, folder: Path) -> None:
        """Use an open database.

        Args:
            engine: from `open_database`.
            folder: the data folder, absolute.
        """
        self.folder = folder
        self.job_queue = JobQueue(engine)
        self.idempotency_keys = IdempotencyKeys(engine)
        self.specimens, self.methods = SpecimenStore(engine), MethodStore(engine)
        self.method_library = MethodLibrary(self.methods)
        self.approvals = ApprovalStore(engine)
        self.certificates, self.checks = CertificateStore(engine), CheckStore(engine)
        self.campaigns = CampaignTable(engine)
        self.users, self.tokens, self.sessions = UserStore(engine), TokenStore(engine), SessionStore(engine)
        self.notebook, self.event_journal = Notebook(engine), EventJournal(engine)
        self.signatures = SignatureStore(engine)
        self.log_copies = LogCopies(engine)
        self.change_counter = ChangeCounter(engine)
        self._engine = engine
        # Rows are read after their session has ended, so they must not expire with it.
        self._sessions = sessionmaker(engine, expire_on_commit=False)
        self._skipped: dict[Path, str] = {}

    def close(self) -> None:
        """Close all connections; one that a thread still uses is closed when the thread returns it."""
        self.change_counter.close()
        event.listen(self._engine.pool, "checkin", lambda connection, record: record.close())
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

    def list_runs(
        self, limit: int, before: RunRow | None = None, selection: RunFilter | None = None
    ) -> Sequence[RunRow]:
        """Return runs, newest first.

        Args:
            limit: largest number of runs.
            before: return only runs that come after this one in the order.
            selection: return only these runs; None for all.
        """
        query = (
            select(RunRow)
            .where(*(selection or RunFilter()).make_conditions(self._engine.dialect.name))
            .order_by(RunRow.started.desc(), RunRow.id.desc())
            .limit(limit)
        )
        # Pages start at a row, not at a count: a run that is added meanwhile then shifts no page.
        if before is not None:
            query = query.where(tuple_(RunRow.started, RunRow.id) < tuple_(before.started, before.id))
        with self._sessions() as session:
            return session.scalars(query).all()

    def count_runs(self) -> dict[str, int]:
        """Return the number of runs in each state that occurs."""
        query = select(RunRow.state, func.count()).group_by(RunRow.state)
        with self._sessions() as session:
            return {state: int(count) for state, count in session.execute(query)}

    def find_method_version(self, name: str, sha256: str) -> int | None:
        """Return the version of a method with a content; None if that content is not known under its name."""
        if name in list_shipped_methods() and load_method(name).compute_sha256() == sha256:
            return SHIPPED_VERSION
        return self.methods.find_version(name, sha256)

    def find_run_by_log(self, path: Path) -> RunRow | None:
        """Return the run that a log belongs to, or None."""
        with self._sessions() as session:
            return session.scalar(select(RunRow).where(RunRow.log == self.make_name(path)))

    def note_skipped(self, path: Path, why: str) -> bool:
        """Note why a file is not catalogued, and return whether the reason is new."""
        is_new = self._skipped.get(path) != why
        self._skipped[path] = why
        return is_new

    def is_skipped(self, path: Path) -> bool:
        """Return whether a file was found that cannot be catalogued."""
        return path in self._skipped

    def list_running(self) -> Sequence[RunRow]:
        """Return the runs in state `running`."""
        with self._sessions() as session:
            return session.scalars(select(RunRow).where(RunRow.state == "running")).all()

    def list_hashed(self) -> Sequence[RunRow]:
        """Return the runs with a stored hash of their log, oldest first."""
        query = select(RunRow).where(RunRow.log_sha256.is_not(None)).order_by(RunRow.started, RunRow.id)
        with self._sessions() as session:
            return session.scalars(query).all()

    def list_present_logs(self) -> Sequence[tuple[str, str]]:
        """Return id and log name of the runs with a stored hash whose log is expected here."""
        is_missing = func.coalesce(RunRow.integrity, "intact") == "missing"
        query = select(RunRow.id, RunRow.log).where(
            RunRow.log_sha256.is_not(None), ~is_missing, RunRow.removed.is_(None)
        )
        with self._sessions() as session:
            return [(run_id, log) for run_id, log in session.execute(query)]

    def list_without_job(self, outcomes: Sequence[RunOutcome]) -> Sequence[RunRow]:
        """Return the runs of the bench with a complete log, one of some outcomes and no job, the oldest first.

        A kill between the end of a run and the request of its first job leaves such a run.
        """
        has_job = select(JobRow.id).where(JobRow.run_id == RunRow.id).exists()
        query = select(RunRow).where(
            RunRow.source == "run",
            RunRow.outcome.in_(outcomes),
            RunRow.log_sha256.is_not(None),
            RunRow.trashed.is_(None),
            ~has_job,
        )
        with self._sessions() as session:
            return session.scalars(query.order_by(RunRow.started, RunRow.id)).all()

    def list_unread(self, limit: int) -> Sequence[RunRow]:
        """Return runs with a complete log whose losses and events were not read, the newest first."""
        query = select(RunRow).where(RunRow.log_sha256.is_not(None), RunRow.alarms.is_(None))
        with self._sessions() as session:
            return session.scalars(query.order_by(RunRow.started.desc()).limit(limit)).all()

    def update_run(self, run_id: str, **values: Any) -> RunRow:
        """Set columns of a run and return the changed run."""
        with self._sessions.begin() as session:
            row = session.get_one(RunRow, run_id)
            for name, value in values.items():
                setattr(row, name, value)
            return row

    def end_incomplete(self, run_id: str, reason: str) -> RunRow:
        """End a run as incomplete and return it."""
        return self.update_run(run_id, state="ended", outcome="incomplete", reason=reason)

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

    def list_jobs_of_runs(self, run_ids: Sequence[str], limit: int) -> Sequence[JobRow]:
        """Return the newest jobs of each run, newest first, and the newest done job of each kind, however old.

        Args:
            run_ids: ids of the runs.
            limit: largest number of newest jobs of one run.
        """
        order = (JobRow.created.desc(), JobRow.id)
        age = func.row_number().over(partition_by=JobRow.run_id, order_by=order)
        age_in_state = func.row_number().over(
            partition_by=(JobRow.run_id, JobRow.kind, JobRow.state), order_by=order
        )
        ranked = select(JobRow.id, JobRow.state, age.label("age"), age_in_state.label("age_in_state"))
        ranks = ranked.where(JobRow.run_id.in_(run_ids)).subquery()
        is_newest_done = (ranks.c.state == "done") & (ranks.c.age_in_state == 1)
        query = select(JobRow).join(ranks, JobRow.id == ranks.c.id).where((ranks.c.age <= limit) | is_newest_done)
        with self._sessions() as session:
            return session.scalars(query.order_by(*order)).all()

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


@contextmanager
def open_catalogue(data: Path, *, is_created: bool = False) -> Iterator[Catalogue]:
    """Open the catalogue of a data folder for the duration of a block; a service may run meanwhile.

    Args:
        data: data folder.
        is_created: create folder and catalogue if they are missing.

    Raises:
        CatalogueError: there is no catalogue, or it cannot be opened or created.
    """
    folder = data.resolve()
    if is_created:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise CatalogueError(f"{folder} cannot be created: {error.strerror}; use another --data") from None
    url = locate_catalogue(folder) if is_created else find_catalogue(folder)
    catalogue = Catalogue(open_database(url), folder)
    try:
        yield catalogue
    finally:
        catalogue.close()

"""Objects shared by all routes, created when the service starts."""

import asyncio
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Annotated
from weakref import WeakValueDictionary

from fastapi import Depends
from starlette.requests import HTTPConnection

from bench.agent_protocol import AgentStatus
from bench.campaigns import CampaignStore
from bench.catalogue import Catalogue, JobRow, RunRow
from bench.config import DEFAULT_BENCH
from bench.disk import SpaceMonitor
from bench.jobs import JobEngine, JobManager
from bench.log_store import LocalLogs, LogCopier
from bench.oidc import Provider
from bench.people import AttemptCounter, SignInCodes
from bench.samples import SampleStore
from bench.service.access import Authenticator
from bench.service.audit import AuditTrail
from bench.service.benches import ServedBench, ServedBenches
from bench.service.problems import make_not_found
from bench.service.run_registry import RunRegistry
from bench.service.views import Run, make_run_view

MAX_JOBS = 50
"""Largest number of newest jobs in the view of a run; its newest results are shown however old they are."""


@dataclass(frozen=True)
class Shown:
    """State that lists show: one state of the catalogue, and one status of each agent, if it matters."""

    changes: int
    """Number of the catalogue's state, from `ChangeCounter`."""
    statuses: tuple[AgentStatus | None, ...] = ()

    def is_same(self, other: "Shown") -> bool:
        """Return whether both are the same state and the same messages of the agents."""
        pairs = zip(self.statuses, other.statuses, strict=True)
        return self.changes == other.changes and all(one is another for one, another in pairs)


@dataclass(frozen=True)
class ServiceContext:
    """Objects shared by all routes."""

    authenticator: Authenticator
    catalogue: Catalogue
    benches: ServedBenches
    engine: JobEngine
    job_manager: JobManager
    registry: RunRegistry
    space_monitor: SpaceMonitor
    sample_store: SampleStore
    campaign_store: CampaignStore
    audit: AuditTrail
    local_logs: LocalLogs
    key_locks: WeakValueDictionary[str, asyncio.Lock] = field(default_factory=WeakValueDictionary)
    """Locks of the idempotency keys of requests in progress."""
    attempts: AttemptCounter = field(default_factory=AttemptCounter)
    """Failed sign-ins by user name, and by client address for tokens and codes."""
    codes: "SignInCodes[tuple[str, str]]" = field(default_factory=SignInCodes)
    """Codes for another device; the owner is kind and subject of a session."""
    provider: Provider | None = None
    """Provider by which persons sign in; None without one."""
    log_copier: LogCopier | None = None
    """Copies the logs to a store; None without one."""
    _descriptions: dict[Callable[["ServiceContext"], str], tuple[int, date, str]] = field(
        default_factory=dict, init=False
    )
    """Descriptions of the catalogue, each with the state of the catalogue and the day that it describes."""

    @property
    def data(self) -> Path:
        """Data folder."""
        return self.catalogue.folder

    def find_shown_catalogue(self) -> Shown | None:
        """Return the state of the catalogue that lists show; None if the database cannot tell a change."""
        changes = self.catalogue.change_counter.read()
        return None if changes is None else Shown(changes)

    def find_shown(self) -> Shown | None:
        """Return what lists show that also depend on the benches; None if the database cannot tell a change."""
        shown = self.find_shown_catalogue()
        return shown and replace(shown, statuses=self.benches.list_statuses())

    def describe_catalogue(self, describe: Callable[["ServiceContext"], str]) -> str:
        """Return a description of the catalogue; it is made again after a change, and on the next day.

        Args:
            describe: makes the description, of nothing but catalogue, names of the benches and day.

        Raises:
            CatalogueUnavailableError: the catalogue cannot be used at present.
        """
        # Read before the description is made: a change meanwhile then only makes the next call describe again.
        changes, day = self.catalogue.change_counter.read(), datetime.now(UTC).date()
        if changes is None:
            return describe(self)
        if self._descriptions.get(describe, ())[:2] != (changes, day):
            self._descriptions[describe] = changes, day, describe(self)
        return self._descriptions[describe][2]

    def get_bench_of_run(self, run_id: str) -> ServedBench:
        """Return the bench of a run; one in progress need not be in the catalogue.

        Raises:
            ProblemError: there is no such run, or its bench is not served.
        """
        if not self.benches.are_several:  # nothing delays a stop
            return self.benches.get(None)
        return self.benches.find_with_run(run_id) or self.benches.get(self.get_run(run_id).bench or DEFAULT_BENCH)

    def get_run(self, run_id: str) -> RunRow:
        """Return the run with this id.

        Raises:
            ProblemError: there is no such run.
        """
        row = self.catalogue.get_run(run_id)
        if row is None:
            raise make_not_found("run", run_id)
        return row

    def locate_log(self, row: RunRow) -> Path:
        """Return the path of the log of a run; fetch a log that was removed after its copy.

        Raises:
            LogError: it cannot be fetched.
        """
        return self.local_logs.locate(row)

    def get_job(self, job_id: str) -> JobRow:
        """Return the job with this id.

        Raises:
            ProblemError: there is no such job.
        """
        row = self.catalogue.get_job(job_id)
        if row is None:
            raise make_not_found("job", job_id)
        return row

    def make_run_views(self, *rows: RunRow) -> list[Run]:
        """Return the views of runs, each with its jobs."""
        statuses, jobs = self.benches.list_statuses(), defaultdict(list)
        for job in self.catalogue.list_jobs_of_runs([row.id for row in rows], MAX_JOBS):
            jobs[job.run_id].append(job)
        return [make_run_view(row, jobs[row.id], *statuses) for row in rows]


def _get_context(connection: HTTPConnection) -> ServiceContext:
    context: ServiceContext = connection.app.state.context
    return context


Context = Annotated[ServiceContext, Depends(_get_context)]


async def _get_addressed_bench(connection: HTTPConnection, context: Context) -> ServedBench:
    advice = "use /api/v1/benches/NAME/... in place of /api/v1/bench/..."
    return context.benches.get(connection.path_params.get("name"), advice)


AddressedBench = Annotated[ServedBench, Depends(_get_addressed_bench)]
"""Bench in the path of a request below ``/benches/{name}``, or the only bench below ``/bench``."""

"""Objects shared by all routes, created when the service starts."""

import asyncio
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated
from weakref import WeakValueDictionary

from fastapi import Depends
from starlette.requests import HTTPConnection

from bench.agent_protocol import AgentStatus
from bench.catalogue import Catalogue, JobRow, RunRow
from bench.disk import SpaceMonitor
from bench.jobs import JobEngine, JobManager
from bench.live import LiveBroadcaster
from bench.log_store import LocalLogs, LogCopier
from bench.oidc import Provider
from bench.people import AttemptCounter, SignInCodes
from bench.samples import SampleStore
from bench.service.access import Authenticator
from bench.service.agent_monitor import AgentMonitor
from bench.service.audit import AuditTrail
from bench.service.campaigns import CampaignExecutor
from bench.service.problems import make_not_found
from bench.service.run_registry import RunRegistry
from bench.service.views import Run, make_run_view

MAX_JOBS = 50
"""Largest number of newest jobs in the view of a run; its newest results are shown however old they are."""


@dataclass(frozen=True)
class Shown:
    """State that lists show: one state of the catalogue, and one status of the agent."""

    changes: int
    """Number of the catalogue's state, from `ChangeCounter`."""
    status: AgentStatus | None

    def is_same(self, other: "Shown") -> bool:
        """Return whether both are the same state and the same message of the agent."""
        return self.changes == other.changes and self.status is other.status


@dataclass(frozen=True)
class ServiceContext:
    """Objects shared by all routes."""

    authenticator: Authenticator
    catalogue: Catalogue
    monitor: AgentMonitor
    live: LiveBroadcaster
    engine: JobEngine
    job_manager: JobManager
    registry: RunRegistry
    has_local_logs: bool
    """True if the agent writes into the service's data folder."""
    space_monitor: SpaceMonitor
    sample_store: SampleStore
    campaigns: CampaignExecutor
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

    @property
    def data(self) -> Path:
        """Data folder."""
        return self.catalogue.folder

    def find_shown(self) -> Shown | None:
        """Return what lists show at present; None if the database cannot tell a change."""
        changes = self.catalogue.change_counter.read()
        return None if changes is None else Shown(changes, self.monitor.latest_status)

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
        status, jobs = self.monitor.latest_status, defaultdict(list)
        for job in self.catalogue.list_jobs_of_runs([row.id for row in rows], MAX_JOBS):
            jobs[job.run_id].append(job)
        return [make_run_view(row, jobs[row.id], status) for row in rows]


def _get_context(connection: HTTPConnection) -> ServiceContext:
    context: ServiceContext = connection.app.state.context
    return context


Context = Annotated[ServiceContext, Depends(_get_context)]

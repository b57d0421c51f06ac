"""Objects shared by all routes, created when the service starts."""

import asyncio
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated
from weakref import WeakValueDictionary

from fastapi import Depends
from starlette.requests import HTTPConnection

from bench.catalogue import Catalogue, JobRow, RunRow
from bench.disk import SpaceMonitor
from bench.jobs import JobEngine, JobManager
from bench.live import LiveBroadcaster
from bench.samples import SampleStore
from bench.service.access import Access
from bench.service.agent_monitor import AgentMonitor
from bench.service.campaigns import CampaignExecutor
from bench.service.problems import make_not_found
from bench.service.run_registry import RunRegistry
from bench.service.views import Run, make_run_view

MAX_JOBS = 50
"""Largest number of newest jobs in the view of a run; its newest results are shown however old they are."""


@dataclass(frozen=True)
class ServiceContext:
    """Objects shared by all routes."""

    access: Access
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
    key_locks: WeakValueDictionary[str, asyncio.Lock] = field(default_factory=WeakValueDictionary)
    """Locks of the idempotency keys of requests in progress."""

    @property
    def data(self) -> Path:
        """Data folder."""
        return self.catalogue.folder

    def get_run(self, run_id: str) -> RunRow:
        """Return the run with this id.

        Raises:
            ProblemError: there is no such run.
        """
        row = self.catalogue.get_run(run_id)
        if row is None:
            raise make_not_found("run", run_id)
        return row

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
        jobs = self.catalogue.list_jobs_of_runs([row.id for row in rows], MAX_JOBS)
        return [
            make_run_view(row, [job for job in jobs if job.run_id == row.id], self.monitor.latest_status)
            for row in rows
        ]


def _get_context(connection: HTTPConnection) -> ServiceContext:
    context: ServiceContext = connection.app.state.context
    return context


Context = Annotated[ServiceContext, Depends(_get_context)]

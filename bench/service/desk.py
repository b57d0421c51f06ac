"""What the routes work with, put together once when the service starts."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from fastapi import Depends
from starlette.requests import HTTPConnection

from bench.catalogue.catalogue import Catalogue
from bench.catalogue.models import JobRow, RunRow
from bench.jobs.engine import Engine
from bench.jobs.keeper import JobKeeper
from bench.service.access import Access
from bench.service.agent_watch import AgentWatch
from bench.service.live import Live
from bench.service.problems import not_found
from bench.service.run_book import RunBook
from bench.service.views import Run, run_view

MOST_JOBS_SHOWN = 200
"""[1] jobs that are looked through for a page of runs."""


@dataclass(frozen=True)
class Desk:
    """Everything within a route's reach."""

    access: Access
    catalogue: Catalogue
    watch: AgentWatch
    live: Live
    engine: Engine
    keeper: JobKeeper
    book: RunBook
    logs_here: bool
    """Whether the agent writes into the service's data folder."""

    @property
    def data(self) -> Path:
        """The data folder."""
        return self.catalogue.folder

    def run(self, run_id: str) -> RunRow:
        """A run.

        Raises:
            ProblemError: there is none of that id.
        """
        row = self.catalogue.run(run_id)
        if row is None:
            raise not_found("run", run_id)
        return row

    def job(self, job_id: str) -> JobRow:
        """A job.

        Raises:
            ProblemError: there is none of that id.
        """
        row = self.catalogue.job(job_id)
        if row is None:
            raise not_found("job", job_id)
        return row

    def shown(self, *rows: RunRow) -> list[Run]:
        """Runs as they are shown, each with its jobs."""
        jobs = self.catalogue.jobs(MOST_JOBS_SHOWN, [row.id for row in rows])
        return [run_view(row, [job for job in jobs if job.run_id == row.id], self.watch.latest) for row in rows]


def _desk(connection: HTTPConnection) -> Desk:
    desk: Desk = connection.app.state.desk
    return desk


AtDesk = Annotated[Desk, Depends(_desk)]

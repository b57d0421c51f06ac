"""Jobs: listed, looked at, cancelled."""

import asyncio
from typing import Annotated

from fastapi import APIRouter, Query

from bench.catalogue.models import UNFINISHED
from bench.service.desk import AtDesk
from bench.service.problems import conflict
from bench.service.views import Job, JobList, job_view

router = APIRouter(prefix="/jobs", tags=["jobs"])


@router.get("")
def jobs(desk: AtDesk, limit: Annotated[int, Query(ge=1, le=200, description="how many at most")] = 50) -> JobList:
    """Jobs, newest first."""
    return JobList(items=tuple(job_view(row) for row in desk.catalogue.jobs(limit)))


@router.get("/{job_id}")
def job(job_id: str, desk: AtDesk) -> Job:
    """One job."""
    return job_view(desk.job(job_id))


@router.post("/{job_id}/cancel")
async def cancel(job_id: str, desk: AtDesk) -> Job:
    """End a job; one that a worker has begun is `running` until its process has ended."""
    row = await asyncio.to_thread(desk.job, job_id)
    if row.state not in UNFINISHED:
        raise conflict("job-ended", "The job has ended", f"job {job_id} is {row.state}; nothing is left to cancel")
    return job_view(await desk.keeper.cancel(row))

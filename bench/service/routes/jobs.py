"""Routes that list, show and cancel jobs."""

import asyncio
from typing import Annotated

from fastapi import APIRouter, Query

from bench.catalogue import UNFINISHED_STATES
from bench.service.context import Context
from bench.service.problems import make_conflict
from bench.service.views import Job, JobList, make_job_view

router = APIRouter(prefix="/jobs", tags=["jobs"])


@router.get("")
def list_jobs(
    context: Context, limit: Annotated[int, Query(ge=1, le=200, description="largest number of items")] = 50
) -> JobList:
    """List the jobs, newest first."""
    return JobList(items=tuple(make_job_view(row) for row in context.catalogue.list_jobs(limit)))


@router.get("/{job_id}")
def get_job(job_id: str, context: Context) -> Job:
    """Return one job."""
    return make_job_view(context.get_job(job_id))


@router.post("/{job_id}/cancel")
async def cancel_job(job_id: str, context: Context) -> Job:
    """Cancel a job; a job on a worker stays `running` until its process has ended."""
    row = await asyncio.to_thread(context.get_job, job_id)
    if row.state not in UNFINISHED_STATES:
        raise make_conflict(
            "job-ended", "The job has ended", f"job {job_id} cannot be cancelled; its state is {row.state}"
        )
    return make_job_view(await context.job_manager.cancel(row))

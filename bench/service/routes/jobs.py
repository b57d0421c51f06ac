"""Routes that list, show, cancel and repeat jobs."""

import asyncio
from typing import Annotated

from fastapi import APIRouter, Query

from bench.catalogue import UNFINISHED_STATES, JobFilter, JobState
from bench.jobs import Job, JobKind, JobPage, RetryRequest, make_job_view
from bench.service.audit import note_old
from bench.service.context import Context
from bench.service.problems import make_conflict
from bench.service.requests import IDEMPOTENT, IdempotentRoute

router = APIRouter(prefix="/jobs", tags=["jobs"], route_class=IdempotentRoute)


@router.get("")
def list_jobs(
    context: Context,
    limit: Annotated[int, Query(ge=1, le=200, description="largest number of items")] = 50,
    before: Annotated[str | None, Query(description="`next` of the previous page")] = None,
    state: Annotated[list[JobState] | None, Query(description="only jobs in one of these states")] = None,
    kind: Annotated[JobKind | None, Query(description="only jobs of this kind")] = None,
    run: Annotated[str | None, Query(description="only jobs on the run with this id")] = None,
) -> JobPage:
    """List the jobs, newest first. The queue is `?state=queued&state=running`; `position` gives its order."""
    queue = context.catalogue.job_queue
    # One job more than shown, to find out whether there is a next page.
    last = None if before is None else context.get_job(before)
    rows = queue.list_jobs(JobFilter(state, kind, run), limit + 1, last)
    places = queue.rank()
    items = tuple(make_job_view(row, places) for row in rows[:limit])
    return JobPage(items=items, next=items[-1].id if len(rows) > limit else None)


@router.get("/{job_id}")
def get_job(job_id: str, context: Context) -> Job:
    """Return one job."""
    return make_job_view(context.get_job(job_id), context.catalogue.job_queue.rank())


@router.post("/{job_id}/cancel")
async def cancel_job(job_id: str, context: Context) -> Job:
    """Cancel a job; a job on a worker stays `running` until its processes have ended, within a second."""
    row = await asyncio.to_thread(context.get_job, job_id)
    note_old({"state": row.state})
    if row.state not in UNFINISHED_STATES:
        raise make_conflict(
            "job-ended", "The job has ended", f"job {job_id} cannot be cancelled; its state is {row.state}"
        )
    return make_job_view(await context.job_manager.cancel(row))


@router.post("/{job_id}/retry", dependencies=[IDEMPOTENT])
async def retry_job(job_id: str, context: Context, request: RetryRequest) -> Job:
    """Queue a failed or cancelled job again; it keeps its id, and its attempts are counted on."""
    row = await asyncio.to_thread(context.get_job, job_id)
    note_old({"state": row.state, "attempts": row.attempts})
    repeated = await context.job_manager.retry(row, request.reason)
    if repeated is None:
        raise make_conflict(
            "job-not-repeatable",
            "The job cannot be repeated",
            f"job {job_id} is {row.state}; only a failed or cancelled job can be repeated",
        )
    return make_job_view(repeated)

"""Routes that move a run to the trash, and restore it; nothing is deleted."""

import asyncio

from fastapi import APIRouter

from bench.catalogue import UNFINISHED_STATES, JobFilter, RunRow, move_to_trash, restore_from_trash
from bench.service.audit import note_old
from bench.service.context import Context, ServiceContext
from bench.service.problems import make_conflict
from bench.service.views import Run

router = APIRouter(prefix="/runs", tags=["recordings"])
_MAX_JOBS = 1000


@router.delete("/{run_id}")
async def trash_run(run_id: str, context: Context) -> Run:
    """Move a run and its log to the trash, and cancel its jobs; `GET /runs?trash=true` lists the trash."""
    row = await asyncio.to_thread(context.get_run, run_id)
    note_old(_describe(row))
    if row.state == "running":
        raise make_conflict("run-not-ended", "The run goes on", f"run {run_id} is in progress; stop it first")
    if row.trashed is not None:
        raise make_conflict("in-trash", "In the trash", f"run {run_id} is in the trash already")
    await _cancel_jobs(context, row)
    return await _move(context, row, is_restored=False)


@router.post("/{run_id}/restore")
async def restore_run(run_id: str, context: Context) -> Run:
    """Move a run and its log back from the trash."""
    row = await asyncio.to_thread(context.get_run, run_id)
    note_old(_describe(row))
    if row.trashed is None:
        raise make_conflict("not-in-trash", "Not in the trash", f"run {run_id} is not in the trash")
    return await _move(context, row, is_restored=True)


def _describe(row: RunRow) -> dict[str, str | None]:
    return {"trashed": None if row.trashed is None else row.trashed.isoformat(), "log": row.log}


async def _cancel_jobs(context: ServiceContext, row: RunRow) -> None:
    unfinished = JobFilter(UNFINISHED_STATES, None, row.id)
    for job in await asyncio.to_thread(context.catalogue.job_queue.list_jobs, unfinished, _MAX_JOBS):
        await context.job_manager.cancel(job)


async def _move(context: ServiceContext, row: RunRow, *, is_restored: bool) -> Run:
    async with context.registry.lock:  # no scan may see a log that is being moved
        move = restore_from_trash if is_restored else move_to_trash
        moved = await asyncio.to_thread(move, context.catalogue, row)
    return (await asyncio.to_thread(context.make_run_views, moved))[0]

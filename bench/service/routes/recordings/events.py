"""Routes of the events of a run, and of benches and runs together."""

from typing import Annotated

from fastapi import APIRouter, Query

from bench.catalogue import EventRow
from bench.service.context import Context
from bench.service.routes.recordings.views import EventPage, EventView

router = APIRouter(tags=["recordings"])
MAX_NUMBER = 2**31 - 1
Limit = Annotated[int, Query(ge=1, le=1000, description="largest number of items")]
After = Annotated[int, Query(ge=0, le=MAX_NUMBER, description="`next` of the previous page")]


@router.get("/runs/{run_id}/events")
def list_run_events(run_id: str, context: Context, limit: Limit = 200, after: After = 0) -> EventPage:
    """List the events of a run in their order; those of its log once it has ended."""
    context.get_run(run_id)
    rows = context.catalogue.event_journal.list_of_run(run_id, limit + 1, after)
    items = tuple(_make_view(row) for row in rows[:limit])
    return EventPage(items=items, next=items[-1].id if len(rows) > limit else None)


@router.get("/events")
def list_events(
    context: Context,
    limit: Limit = 200,
    before: Annotated[int | None, Query(ge=0, le=MAX_NUMBER, description="`next` of the previous page")] = None,
    bench: Annotated[str | None, Query(max_length=100, description="only those of this bench")] = None,
) -> EventPage:
    """List the events of benches and runs, the newest first."""
    rows = context.catalogue.event_journal.list_newest(limit + 1, before, bench)
    items = tuple(_make_view(row) for row in rows[:limit])
    return EventPage(items=items, next=items[-1].id if len(rows) > limit else None)


def _make_view(row: EventRow) -> EventView:
    return EventView(
        id=row.id, run=row.run_id, bench=row.bench, at=row.at, time_s=row.time_s, kind=row.kind, text=row.text
    )

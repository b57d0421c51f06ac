"""Routes of notes and tags: an append-only layer beside the log, which never changes."""

from http import HTTPStatus

from fastapi import APIRouter, Response

from bench.catalogue import NoteRow
from bench.service.audit import note_old
from bench.service.context import Context
from bench.service.problems import ProblemError
from bench.service.requests import (
    IDEMPOTENT,
    PRECONDITIONS,
    ExpectedTag,
    IdempotentRoute,
    Sender,
    get_author,
    is_expected,
    make_tag,
)
from bench.service.routes.recordings.events import After, Limit
from bench.service.routes.recordings.views import NotePage, NoteRequest, NoteView, RunChange
from bench.service.views import Run

router = APIRouter(prefix="/runs", tags=["recordings"], route_class=IdempotentRoute)


@router.get("/{run_id}/notes")
def list_notes(run_id: str, context: Context, limit: Limit = 200, after: After = 0) -> NotePage:
    """List the notes on a run, the oldest first; a change of its tags is a note, too."""
    context.get_run(run_id)
    rows = context.catalogue.notebook.list_notes(run_id, limit + 1, after)
    items = tuple(_make_view(row) for row in rows[:limit])
    return NotePage(items=items, next=items[-1].id if len(rows) > limit else None)


@router.post("/{run_id}/notes", status_code=201, dependencies=[IDEMPOTENT])
def add_note(run_id: str, request: NoteRequest, context: Context, sender: Sender) -> NoteView:
    """Add a note to a run. Notes are never changed; a correction is a further note."""
    context.get_run(run_id)
    return _make_view(
        context.catalogue.notebook.add_note(run_id, get_author(sender, request.author), request.text)
    )


@router.patch("/{run_id}", responses=PRECONDITIONS)
def change_run(
    run_id: str,
    change: RunChange,
    context: Context,
    response: Response,
    sender: Sender,
    expected: ExpectedTag = None,
) -> Run:
    """Change the tags of a run, and note who did; refused if the run was changed since it was read."""
    row = context.get_run(run_id)
    if expected is None:
        detail = "PATCH needs the header If-Match with the ETag of GET /runs/{id}; read the run first"
        raise ProblemError(HTTPStatus.PRECONDITION_REQUIRED, "if-match-missing", "If-Match is missing", detail)
    note_old({"tags": row.tags})
    is_current = is_expected(expected, row.revision)
    notebook = context.catalogue.notebook
    author = get_author(sender, change.author)
    changed = notebook.change_tags(run_id, author, change.tags, row.revision) if is_current else None
    if changed is None:
        detail = f"run {run_id} was changed meanwhile; read it again and repeat the change"
        raise ProblemError(HTTPStatus.PRECONDITION_FAILED, "changed-meanwhile", "Changed meanwhile", detail)
    view = context.make_run_views(changed)[0]
    response.headers["ETag"] = make_tag(view, changed.revision)
    return view


def _make_view(row: NoteRow) -> NoteView:
    return NoteView(id=row.id, at=row.at, author=row.author, kind=row.kind, text=row.text)

"""Routes of the audit trail: search, head, verification, export."""

from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Query
from fastapi.responses import StreamingResponse
from pydantic import Field

from bench.audit import (
    AuditEntry,
    AuditFilter,
    ExportFormat,
    export_entries,
    list_newest,
    parse_head,
    verify_chain,
)
from bench.service.context import Context
from bench.service.requests import ZonedTime
from bench.service.views import View

router = APIRouter(prefix="/audit", tags=["audit"])
_MEDIA_TYPES = {"json": "application/json", "csv": "text/csv"}
_FILE: dict[int | str, dict[str, Any]] = {
    200: {"description": "all entries with the head", "content": {one: {} for one in _MEDIA_TYPES.values()}}
}
_MAX_TEXT = 300
_Text = Annotated[str, Query(max_length=_MAX_TEXT)]


class AuditPage(View):
    """Entries, the newest first."""

    items: tuple[AuditEntry, ...]
    next: int | None = Field(description="value of `before` for the next page; null on the last page")


class AuditHead(View):
    """Last entry. Kept elsewhere, it later shows that nothing up to it was changed or removed."""

    head: str = Field(description="SEQ:SHA256, as `mrbench audit verify --head` takes it")
    seq: int = Field(description="number of the last entry; 0 without entries")
    sha256: str = Field(description="its hash")
    utc: datetime = Field(description="UTC of this answer")


class AuditVerificationRequest(View):
    """Request of a verification."""

    head: str | None = Field(default=None, max_length=_MAX_TEXT, description="head that was kept, SEQ:SHA256")


class AuditVerification(View):
    """Result of a verification."""

    intact: bool
    entries: int = Field(description="number of entries before the first fault")
    head: str = Field(description="last of these, SEQ:SHA256")
    fault: str = Field(description="first altered entry and the reason, for a person; empty without one")
    imported: int = Field(description="number of entries of the rig agent among them")
    kept: int = Field(description="number of incomplete lines of killed processes, each kept in an entry")


@router.get("")
def list_entries(
    context: Context,
    limit: Annotated[int, Query(ge=1, le=500, description="largest number of items")] = 100,
    before: Annotated[int | None, Query(ge=1, description="`next` of the previous page")] = None,
    actor: Annotated[_Text, Query(description="actor, exactly, such as `user:mcurie`")] = "",
    action: Annotated[_Text, Query(description="part of the action")] = "",
    target: Annotated[_Text, Query(description="target, exactly, or one of its ids")] = "",
    text: Annotated[_Text, Query(description="part of the whole entry")] = "",
    time_from: Annotated[ZonedTime | None, Query(alias="from", description="earliest time, with a zone")] = None,
    time_to: Annotated[ZonedTime | None, Query(alias="to", description="before this time, with a zone")] = None,
) -> AuditPage:
    """List the entries that meet all given conditions, the newest first."""
    wanted = AuditFilter(
        actor=actor, action=action, target=target, text=text, since=_format(time_from), until=_format(time_to)
    )
    found = list_newest(context.audit.path, limit + 1, before, wanted)
    items = tuple(found[:limit])
    return AuditPage(items=items, next=items[-1].seq if len(found) > limit else None)


@router.get("/head")
def get_head(context: Context) -> AuditHead:
    """Return the last entry, to be kept elsewhere."""
    head = context.audit.get_head()
    return AuditHead(head=str(head), seq=head.seq, sha256=head.sha256, utc=datetime.now(UTC))


@router.post("/verify")
def verify(request: AuditVerificationRequest, context: Context) -> AuditVerification:
    """Verify every hash; with a head that was kept, also that the end is not missing."""
    known = None if request.head is None else parse_head(request.head)
    result = verify_chain(context.audit.path, known)
    return AuditVerification(
        intact=not result.fault,
        entries=result.entries,
        head=str(result.head),
        fault=result.fault,
        imported=len(result.imported),
        kept=result.kept,
    )


@router.get("/export", response_class=StreamingResponse, responses=_FILE)
def export(
    context: Context,
    file_format: Annotated[ExportFormat, Query(alias="format", description="of the file")] = "json",
) -> StreamingResponse:
    """Return all entries with the head."""
    head = context.audit.get_head()
    headers = {"Content-Disposition": f'attachment; filename="audit-{head.seq}.{file_format}"'}
    content = export_entries(context.audit.path, head, file_format)
    return StreamingResponse(content, media_type=_MEDIA_TYPES[file_format], headers=headers)


def _format(time: datetime | None) -> str:
    """Return a time as the entries have it; empty without one."""
    return "" if time is None else time.astimezone(UTC).isoformat(timespec="microseconds")

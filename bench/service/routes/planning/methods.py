"""Routes that list, return and store methods."""

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response

from bench.catalogue import SHIPPED_VERSION, ApprovalRow, MethodRow, StoredMethod
from bench.methods import Method, compile_method, list_shipped_methods, load_method
from bench.service.audit import note_old
from bench.service.bench_check import describe_drive_obstacle
from bench.service.context import Context, ServiceContext
from bench.service.requests import (
    IDEMPOTENT,
    NOT_MODIFIED,
    IdempotentRoute,
    KnownTags,
    Sender,
    send_unless_known,
)
from bench.service.routes.planning.method_library import describe_facts, find_method, list_versions
from bench.service.routes.planning.views import MethodPage, MethodSummary, MethodVersions
from bench.service.views import BenchChoice

router = APIRouter(prefix="/methods", tags=["methods"], route_class=IdempotentRoute)
_SAME: dict[int | str, dict[str, Any]] = {
    200: {"description": "a version with this content is stored, and is returned", "model": MethodSummary}
}


@router.get("")
def list_all_methods(
    context: Context,
    limit: Annotated[int, Query(ge=1, le=500, description="largest number of items")] = 200,
    before: Annotated[str | None, Query(description="`next` of the previous page")] = None,
    bench: BenchChoice = None,
) -> MethodPage:
    """List the newest version of each method, in the order of the names; unusable ones say why."""
    drive_kind = _find_drive_kind(context, bench)
    newest = context.catalogue.method_library.list_newest()
    found = [one for one in newest if before is None or one.method.name > before]
    approvals = context.catalogue.approvals.find(describe_facts(one.method).sha256 for one in found[:limit])
    items = tuple(_summarise(one, drive_kind, approvals) for one in found[:limit])
    return MethodPage(items=items, next=items[-1].name if len(found) > limit else None)


@router.post("", status_code=201, responses=_SAME, dependencies=[IDEMPOTENT])
def store_method(method: Method, context: Context, response: Response) -> MethodSummary:
    """Store a method as the next version of its name; versions never change, and included ones stay version 1.

    201: a new version. 200: the name has a version of equal content.
    """
    compile_method(method)  # a method that exceeds its own limits is refused
    note_old(_describe_newest(context, method.name))
    stored, is_new = _store(context, method)
    if not is_new:
        response.status_code = 200
    response.headers["Location"] = f"/api/v1/methods/{method.name}/{stored.version}"
    return _show(context, stored)


def _describe_newest(context: ServiceContext, name: str) -> dict[str, Any] | None:
    """Return version and hash of the newest version of a method before another one; None for a new name."""
    row = context.catalogue.methods.get(name)
    if row is not None:
        return {"version": row.version, "sha256": row.sha256}
    if name not in list_shipped_methods():
        return None
    return {"version": SHIPPED_VERSION, "sha256": load_method(name).compute_sha256()}


def _store(context: ServiceContext, method: Method) -> tuple[StoredMethod, bool]:
    sha256, is_shipped = method.compute_sha256(), method.name in list_shipped_methods()
    if is_shipped and load_method(method.name).compute_sha256() == sha256:
        return StoredMethod(method, SHIPPED_VERSION, None), False
    document = method.model_dump(mode="json", by_alias=True, exclude_defaults=True)
    row = MethodRow(name=method.name, version=0, sha256=sha256, document=document, created=datetime.now(UTC))
    stored, is_new = context.catalogue.methods.add(row, SHIPPED_VERSION + is_shipped)
    return StoredMethod(method, stored.version, stored.created), is_new


@router.get("/{name}", response_model=Method, responses=NOT_MODIFIED)
def get_method(name: str, context: Context, known: KnownTags = None) -> Response:
    """Return the document of the newest version of a method; the header `ETag` is the hash of its content."""
    return _send(find_method(context, name), known)


@router.get("/{name}/{version:int}", response_model=Method, responses=NOT_MODIFIED)
def get_method_version(name: str, version: int, context: Context, known: KnownTags = None) -> Response:
    """Return the document of a version of a method; the header `ETag` is the hash of its content."""
    return _send(find_method(context, name, version), known)


def _send(found: StoredMethod, known: str | None) -> Response:
    return send_unless_known(found.method, f'"{found.method.compute_sha256()}"', known, exclude_defaults=True)


@router.get("/{name}/versions")
def list_method_versions(name: str, context: Context, bench: BenchChoice = None) -> MethodVersions:
    """List all versions of a method with their approvals, the newest first."""
    found, drive_kind = list_versions(context, name), _find_drive_kind(context, bench)
    approvals = context.catalogue.approvals.find(describe_facts(one.method).sha256 for one in found)
    return MethodVersions(items=tuple(_summarise(one, drive_kind, approvals) for one in found))


@router.post("/{name}/{version:int}/approval")
def approve_method(name: str, version: int, context: Context, sender: Sender) -> MethodSummary:
    """Approve a version of a method for campaigns that require it; the approval belongs to its content."""
    found = find_method(context, name, version)
    _note_approval(context, found)
    context.catalogue.approvals.approve(found.method.compute_sha256(), sender.full_name)
    return _show(context, found)


@router.delete("/{name}/{version:int}/approval")
def withdraw_approval(name: str, version: int, context: Context) -> MethodSummary:
    """Withdraw the approval of a version; campaigns in progress keep their methods."""
    found = find_method(context, name, version)
    _note_approval(context, found)
    context.catalogue.approvals.withdraw(found.method.compute_sha256())
    return _show(context, found)


def _note_approval(context: ServiceContext, found: StoredMethod) -> None:
    """Hand the former approval of a method to the audit trail."""
    sha256 = found.method.compute_sha256()
    row = context.catalogue.approvals.find([sha256]).get(sha256)
    note_old({"sha256": sha256, "approved_by": row.approved_by if row else None})


def _show(context: ServiceContext, one: StoredMethod) -> MethodSummary:
    approvals = context.catalogue.approvals.find([one.method.compute_sha256()])
    return _summarise(one, _find_drive_kind(context), approvals)


def _find_drive_kind(context: ServiceContext, name: str | None = None) -> str:
    """Return the drive of a bench, or of the only one; empty if it does not answer, or if several are meant."""
    if name is None and context.benches.are_several:
        return ""
    status = context.benches.get(name).monitor.latest_status
    return "" if status is None else status.drive_kind


def _summarise(one: StoredMethod, drive_kind: str, approvals: Mapping[str, ApprovalRow]) -> MethodSummary:
    facts, method = describe_facts(one.method), one.method
    approval = approvals.get(facts.sha256)
    obstacle = describe_drive_obstacle(method, drive_kind)
    return MethodSummary(
        name=method.name,
        version=one.version,
        sha256=facts.sha256,
        source="included" if one.created is None else "stored",
        created=one.created,
        title=method.title,
        duration_s=facts.duration,
        drive_kind=method.drive_kind,
        checkpoints=facts.checkpoints,
        approved=approval.approved if approval else None,
        approved_by=approval.approved_by if approval else "",
        usable=not obstacle,
        obstacle=obstacle,
    )

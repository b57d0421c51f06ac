"""Routes of specimens; a serial number is registered at its first use in a run."""

from http import HTTPStatus
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response

from bench.catalogue import Specimen
from bench.service.audit import note_old
from bench.service.context import Context, ServiceContext
from bench.service.problems import ProblemError, make_conflict, make_not_found
from bench.service.requests import (
    IDEMPOTENT,
    NOT_MODIFIED,
    PRECONDITIONS,
    ExpectedTag,
    IdempotentRoute,
    KnownTags,
    is_expected,
    make_tag,
    send_unless_known,
)
from bench.service.routes.planning.views import (
    SpecimenChange,
    SpecimenLimits,
    SpecimenPage,
    SpecimenRequest,
    SpecimenView,
)

router = APIRouter(prefix="/specimens", tags=["specimens"], route_class=IdempotentRoute)


@router.get("")
def list_specimens(
    context: Context,
    limit: Annotated[int, Query(ge=1, le=200, description="largest number of items")] = 50,
    before: Annotated[str | None, Query(description="`next` of the previous page")] = None,
    text: Annotated[
        str | None, Query(min_length=1, max_length=200, description="in serial number, description or kind")
    ] = None,
) -> SpecimenPage:
    """List the specimens in the order of their serial numbers, those included that only runs name."""
    found = context.catalogue.specimens.list_specimens(limit + 1, before or "", text or "")
    items = tuple(_make_view(one) for one in found[:limit])
    return SpecimenPage(items=items, next=items[-1].serial if len(found) > limit else None)


@router.post("", status_code=201, dependencies=[IDEMPOTENT])
def register_specimen(request: SpecimenRequest, context: Context, response: Response) -> SpecimenView:
    """Register a specimen before its first run, or describe one that only runs name."""
    if not context.catalogue.specimens.describe(request.serial, 0, _make_values(request)):
        detail = f"specimen {request.serial} has a description; change it with PATCH"
        raise make_conflict("specimen-registered", "The specimen is registered", detail)
    return _show(context, request.serial, response)


@router.get("/{serial:path}", response_model=SpecimenView, responses=NOT_MODIFIED)
def get_specimen(serial: str, context: Context, known: KnownTags = None) -> Response:
    """Return one specimen; the header `ETag` names this answer, its first part the state of the description."""
    found = _get_specimen(context, serial)
    view = _make_view(found)
    return send_unless_known(view, make_tag(view, found.revision), known)


@router.patch("/{serial:path}", responses=PRECONDITIONS)
def change_specimen(
    serial: str,
    change: SpecimenChange,
    context: Context,
    response: Response,
    expected: ExpectedTag = None,
) -> SpecimenView:
    """Change the description of a specimen; fields that are left out stay as they are."""
    found = _get_specimen(context, serial)
    if expected is None:
        detail = f"send the ETag of specimen {serial} as If-Match, so that no other change is lost"
        raise ProblemError(HTTPStatus.PRECONDITION_REQUIRED, "if-match-missing", "If-Match is missing", detail)
    values = _make_values(change)
    note_old(_make_view(found).model_dump(mode="json", include=set(values)))
    is_seen = is_expected(expected, found.revision)
    if not is_seen or not context.catalogue.specimens.describe(serial, found.revision, values):
        detail = f"specimen {serial} was changed meanwhile; read it again and repeat the change"
        raise ProblemError(HTTPStatus.PRECONDITION_FAILED, "changed-meanwhile", "Changed meanwhile", detail)
    return _show(context, serial, response)


def _show(context: ServiceContext, serial: str, response: Response) -> SpecimenView:
    """Return the view of a specimen after a change, with its tag in the header."""
    found = _get_specimen(context, serial)
    view = _make_view(found)
    response.headers["ETag"] = make_tag(view, found.revision)
    return view


def _get_specimen(context: ServiceContext, serial: str) -> Specimen:
    found = context.catalogue.specimens.find(serial)
    if found is None:
        raise make_not_found("specimen", serial)
    return found


def _make_values(change: SpecimenChange) -> dict[str, Any]:
    """Return the columns that a request sets; a new description sets all."""
    is_new = isinstance(change, SpecimenRequest)
    values = change.model_dump(exclude={"serial"}, exclude_unset=not is_new)
    if "limits" in values:
        values["limits"] = change.limits.model_dump(exclude_none=True)
    return values


def _make_view(specimen: Specimen) -> SpecimenView:
    row = specimen.row
    return SpecimenView(
        serial=specimen.serial,
        description=row.description or "" if row else "",
        damper_kind=row.damper_kind or "" if row else "",
        drive_kind=row.drive_kind if row else None,
        limits=SpecimenLimits(**(row.limits or {})) if row else SpecimenLimits(),
        registered=row.registered if row else None,
        runs=specimen.runs,
        last_run=specimen.last_run,
    )
